//! Films as GIF (<https://www.w3.org/Graphics/GIF/spec-gif89a.txt>).
//!
//! All pictures have the colours of the first one and some spares: the lights and bodies of a film do not change. A pixel that is as in
//! the picture before is transparent, which compresses well.

use anyhow::Context;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Number of the transparent colour; the colours before it are of the pictures.
const CLEAR: u8 = 255;
/// Bits of each colour that decide about its entry in the palette.
const BITS: u32 = 5;
/// Share of the pixels of the first picture by which the colours are chosen: 1 all, 10 a tenth.
const SAMPLING: i32 = 1;

/// A film while it is written.
pub(super) struct GifFile {
    path: PathBuf,
    size: (u16, u16),
    fps: f64,
    /// Opened with the first picture, whose colours it has.
    open: Option<Open>,
    pictures: u64,
}

struct Open {
    encoder: Encoder<BufWriter<File>>,
    /// Entry of the palette for each colour of [`BITS`].
    entries: Vec<u8>,
    /// Entries of the picture before.
    before: Vec<u8>,
}

impl GifFile {
    /// A film at this path.
    ///
    /// # Errors
    /// It is larger than a GIF can be.
    pub(super) fn create(path: &Path, (width, height): (u32, u32), fps: f64) -> anyhow::Result<Self> {
        let size = (u16::try_from(width)?, u16::try_from(height)?);
        Ok(GifFile { path: path.to_owned(), size, fps, open: None, pictures: 0 })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&mut self, rgb: &[u8]) -> anyhow::Result<()> {
        let failed = || format!("cannot write {}", self.path.display());
        let first = self.open.is_none();
        let open = match &mut self.open {
            Some(open) => open,
            None => self.open.insert(Open::new(&self.path, self.size, rgb).with_context(failed)?),
        };
        let entries: Vec<u8> = rgb.chunks_exact(3).map(|rgb| open.entries[place(rgb)]).collect();
        let shown = match first {
            true => entries.clone(),
            false => {
                let pairs = entries.iter().zip(&open.before);
                pairs.map(|(now, before)| if now == before { CLEAR } else { *now }).collect()
            }
        };
        // Hundredths of a second, so that the sum stays exact.
        let until = |pictures: u64| (100.0 * pictures as f64 / self.fps).round() as u64;
        let delay = until(self.pictures + 1) - until(self.pictures);
        let frame = Frame {
            width: self.size.0,
            height: self.size.1,
            delay: delay.min(u64::from(u16::MAX)) as u16,
            dispose: DisposalMethod::Keep,
            transparent: (!first).then_some(CLEAR),
            buffer: Cow::Owned(shown),
            ..Frame::default()
        };
        open.encoder.write_frame(&frame).with_context(failed)?;
        (open.before, self.pictures) = (entries, self.pictures + 1);
        Ok(())
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn finish(&mut self) -> anyhow::Result<()> {
        let failed = || format!("cannot write {}", self.path.display());
        let Some(open) = self.open.take() else { return Ok(()) };
        open.encoder
            .into_inner()
            .map_err(anyhow::Error::from)
            .and_then(|mut file| Ok(file.flush()?))
            .with_context(failed)
    }
}

/// Place of a colour in [`Open::entries`].
fn place(rgb: &[u8]) -> usize {
    rgb.iter().fold(0, |place, part| place << BITS | usize::from(*part >> (8 - BITS)))
}

impl Open {
    fn new(path: &Path, (width, height): (u16, u16), rgb: &[u8]) -> anyhow::Result<Self> {
        let opaque: Vec<u8> = rgb.chunks_exact(3).flat_map(|rgb| [rgb[0], rgb[1], rgb[2], u8::MAX]).collect();
        let quantised = color_quant::NeuQuant::new(SAMPLING, usize::from(CLEAR), &opaque);
        let mut palette = quantised.color_map_rgb();
        palette.resize(3 * (usize::from(CLEAR) + 1), 0);
        let middle = |bits: usize| ((bits << (8 - BITS)) | (1 << (7 - BITS))) as u8;
        let most = (1 << BITS) - 1;
        let entries = (0..1_usize << (3 * BITS)).map(|k| {
            let color = [k >> (2 * BITS), k >> BITS, k].map(|part| middle(part & most));
            let far = |entry: &[u8]| -> u32 {
                entry.iter().zip(color).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
            };
            let nearest = palette[..3 * usize::from(CLEAR)].chunks_exact(3).enumerate();
            nearest.min_by_key(|(_, entry)| far(entry)).map_or(0, |(k, _)| k as u8)
        });
        let entries: Vec<u8> = entries.collect();
        let file = BufWriter::new(File::create(path)?);
        let mut encoder = Encoder::new(file, width, height, &palette)?;
        encoder.set_repeat(Repeat::Infinite)?;
        Ok(Open { encoder, entries, before: Vec::new() })
    }
}
