//! Lists of a fixed length. Serde's own arrays drop further elements of a TOML list without a word.

use serde::de::{Deserialize, Deserializer, Error};

/// An array that refuses a list of another length.
struct Exactly<T, const N: usize>([T; N]);

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Exactly<T, N> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let list = Vec::<T>::deserialize(from)?;
        let found = list.len();
        let expected = format!("a list of {N}");
        list.try_into().map(Exactly).map_err(|_| D::Error::invalid_length(found, &expected.as_str()))
    }
}

/// Reads `[T; N]`.
pub(crate) fn array<'de, D, T, const N: usize>(from: D) -> Result<[T; N], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Exactly::deserialize(from).map(|exactly| exactly.0)
}

/// Reads `Option<[T; N]>`; the field also needs `serde(default)`.
pub(crate) fn optional<'de, D, T, const N: usize>(from: D) -> Result<Option<[T; N]>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Ok(Option::<Exactly<T, N>>::deserialize(from)?.map(|exactly| exactly.0))
}

/// Reads `Vec<[T; N]>`.
pub(crate) fn list<'de, D, T, const N: usize>(from: D) -> Result<Vec<[T; N]>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    Ok(Vec::<Exactly<T, N>>::deserialize(from)?.into_iter().map(|exactly| exactly.0).collect())
}

/// Reads `[[T; N]; M]`.
pub(crate) fn arrays<'de, D, T, const N: usize, const M: usize>(from: D) -> Result<[[T; N]; M], D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    array::<D, Exactly<T, N>, M>(from).map(|arrays| arrays.map(|exactly| exactly.0))
}
