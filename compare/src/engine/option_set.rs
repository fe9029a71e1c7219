//! Settings that are named settings with some options changed: `stiff5+multiccd=disable+noslip_iterations=10`. Where a value
//! has blanks, the name has commas.

use anyhow::{Context, Result, bail};
use parking_lot::Mutex;
use std::collections::BTreeMap;

/// Options by their names; the last value of an option that is named twice counts.
pub type EngineOptions = &'static [(&'static str, &'static str)];

/// An option, and the values that a search gives it.
#[derive(Clone, Copy, Debug)]
pub struct Dimension(pub &'static str, pub &'static [&'static str]);

/// Named settings with a change that is for a few scenes: a search found it to solve more plays there, or it is documented for what
/// they have. Reports play them there alone.
#[derive(Clone, Copy, Debug)]
pub struct FoundSettings {
    /// Their name.
    pub settings: &'static str,
    /// Cases.
    pub scenes: &'static [&'static str],
}

/// The value of an option.
pub(super) fn get(options: EngineOptions, option: &str) -> Option<&'static str> {
    options.iter().rev().find(|(key, _)| *key == option).map(|(_, value)| *value)
}

/// Whether an engine has these options.
///
/// # Errors
/// There is no option of such a name.
pub(super) fn check<'a>(
    engine: &str,
    options: EngineOptions,
    known: impl Iterator<Item = &'a &'static str> + Clone,
) -> Result<()> {
    for (key, _) in options {
        if !known.clone().any(|it| it == key) {
            let names: Vec<&str> = known.copied().collect();
            bail!("unknown option `{key}` of {engine}; known options: {}", names.join(", "));
        }
    }
    Ok(())
}

/// The mark before a changed option.
const CHANGE: char = '+';

/// The name of settings with one more option changed.
pub fn changed(name: &str, option: &str, value: &str) -> String {
    let before = name.split(CHANGE).filter(|part| part.split_once('=').is_none_or(|(key, _)| key != option));
    let before = before.collect::<Vec<_>>().join("+");
    format!("{before}{CHANGE}{option}={}", value.replace(' ', ","))
}

/// The named settings and the changes of a name.
///
/// # Errors
/// A change is not `option=value`.
pub(super) fn parse(name: &'static str) -> Result<(&'static str, EngineOptions)> {
    let mut parts = name.split(CHANGE);
    let base = parts.next().unwrap_or_default();
    let changes = parts.map(|part| {
        let (key, value) = part
            .split_once('=')
            .with_context(|| format!("`{part}` in the settings `{name}` is not option=value"))?;
        Ok((key, kept(&value.replace(',', " "))))
    });
    Ok((base, changes.collect::<Result<Vec<_>>>()?.leak()))
}

/// A text that lives as long as the program; each is kept once.
pub(super) fn kept(text: &str) -> &'static str {
    static KEPT: Mutex<BTreeMap<String, &'static str>> = Mutex::new(BTreeMap::new());
    let mut all = KEPT.lock();
    all.entry(text.to_owned()).or_insert_with(|| text.to_owned().leak())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_a_changed_option_replaces_it() {
        let name = changed("stiff5", "solref", "0.002 1");
        assert_eq!(name, "stiff5+solref=0.002,1");
        let name = changed(&changed(&name, "condim", "4"), "solref", "-100 -5");
        assert_eq!(name, "stiff5+condim=4+solref=-100,-5");
        let (base, changes) = parse(kept(&name)).expect("it is a name");
        assert_eq!((base, changes), ("stiff5", &[("condim", "4"), ("solref", "-100 -5")][..]));
        assert!(parse("stiff5+condim").is_err());
    }
}
