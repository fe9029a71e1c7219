//! The file of a film or a picture.

use super::ffmpeg::Coder;
use super::gif_file::GifFile;
use anyhow::{Context, bail};
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Kinds of files, by their endings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OutputFormat {
    Mp4,
    Gif,
    Png,
}

impl OutputFormat {
    /// The kind of a file.
    ///
    /// # Errors
    /// It has another ending.
    pub(super) fn of(file: &Path) -> anyhow::Result<Self> {
        let ending = file.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("mp4") => Ok(OutputFormat::Mp4),
            Some("gif") => Ok(OutputFormat::Gif),
            Some("png") => Ok(OutputFormat::Png),
            _ => bail!("--output {}: the name must end in .mp4, .gif or .png", file.display()),
        }
    }

    /// Whether it can have so many pictures in a second.
    ///
    /// # Errors
    /// It cannot.
    pub(super) fn check(self, fps: f64) -> anyhow::Result<()> {
        if self == OutputFormat::Gif && fps > 50.0 {
            bail!("--fps {fps}: a .gif shows at most 50 pictures in a second");
        }
        Ok(())
    }
}

/// Checks that a file can be written; one that is there stays as it is.
///
/// # Errors
/// It cannot be written.
pub(super) fn check_writable(file: &Path) -> anyhow::Result<()> {
    let is_new = !file.exists();
    let failed = || format!("cannot write {}", file.display());
    File::options().append(true).create(true).open(file).with_context(failed)?;
    if is_new {
        fs::remove_file(file).with_context(failed)?;
    }
    Ok(())
}

/// A file that takes pictures, of sRGB with three bytes a pixel.
pub(super) enum Sink {
    Mp4(Coder),
    Gif(GifFile),
    Png { file: PathBuf, size: (u32, u32) },
}

impl Sink {
    /// Opens the file.
    ///
    /// # Errors
    /// The file cannot be written, or the size is not of the kind.
    pub(super) fn new(
        kind: OutputFormat,
        file: &Path,
        size: (u32, u32),
        fps: f64,
        coder: Option<PathBuf>,
    ) -> anyhow::Result<Self> {
        let (width, height) = size;
        match kind {
            OutputFormat::Mp4 if width % 2 == 1 || height % 2 == 1 => {
                bail!("--size {width}x{height}: an .mp4 needs an even width and an even height")
            }
            OutputFormat::Mp4 => {
                let program = coder.context("no ffmpeg was looked for")?;
                Ok(Sink::Mp4(Coder::start(&program, file, size, fps)?))
            }
            OutputFormat::Gif => Ok(Sink::Gif(GifFile::create(file, size, fps)?)),
            OutputFormat::Png => Ok(Sink::Png { file: file.to_owned(), size }),
        }
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write(&mut self, rgb: &[u8]) -> anyhow::Result<()> {
        match self {
            Sink::Mp4(coder) => coder.write(rgb),
            Sink::Gif(file) => file.write(rgb),
            Sink::Png { file, size } => {
                let failed = || format!("cannot write {}", file.display());
                let to = BufWriter::new(File::create(&*file).with_context(failed)?);
                let mut encoder = png::Encoder::new(to, size.0, size.1);
                encoder.set_color(png::ColorType::Rgb);
                encoder.set_depth(png::BitDepth::Eight);
                encoder.write_header().and_then(|mut png| png.write_image_data(rgb)).with_context(failed)
            }
        }
    }

    /// Completes the file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn finish(&mut self) -> anyhow::Result<()> {
        match self {
            Sink::Mp4(coder) => coder.end(),
            Sink::Gif(file) => file.finish(),
            Sink::Png { .. } => Ok(()),
        }
    }
}
