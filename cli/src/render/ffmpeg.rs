//! ffmpeg, which codes films as H.264: of the Python package imageio-ffmpeg, or on the PATH.

use crate::environment::variable;
use anyhow::{Context, bail};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};

/// The program of imageio-ffmpeg, or else the one on the PATH.
///
/// # Errors
/// There is none.
pub(super) fn find() -> anyhow::Result<PathBuf> {
    let python =
        variable("PALMARES_PYTHON").map_or("python3".into(), |name| name.to_string_lossy().into_owned());
    let ask = "import imageio_ffmpeg; print(imageio_ffmpeg.get_ffmpeg_exe())";
    let answer = Command::new(&python).args(["-c", ask]).stderr(Stdio::null()).output();
    if let Ok(answer) = answer
        && answer.status.success()
    {
        let path = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
        if Path::new(&path).is_file() {
            return Ok(path.into());
        }
    }
    let quiet = |program: &str| {
        Command::new(program).arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status()
    };
    if quiet("ffmpeg").is_ok_and(|status| status.success()) {
        return Ok("ffmpeg".into());
    }
    bail!(
        "a film in .mp4 needs ffmpeg: `pip install imageio-ffmpeg` for {python} (PALMARES_PYTHON names \
         another), or an ffmpeg on the PATH; .gif and .png need neither"
    )
}

/// A film while ffmpeg codes it.
pub(super) struct Coder {
    child: Child,
    /// Closed at the end of the film.
    pictures: Option<ChildStdin>,
}

impl Coder {
    /// Starts ffmpeg.
    ///
    /// # Errors
    /// It does not start.
    pub(super) fn start(
        program: &Path,
        file: &Path,
        (width, height): (u32, u32),
        fps: f64,
    ) -> anyhow::Result<Self> {
        let mut command = Command::new(program);
        command.args(["-hide_banner", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
        command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-", "-an"]);
        // The colours of HD video, which players expect; 4:2:0, which all of them can show.
        command.args(["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709"]);
        command.args(["-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-pix_fmt", "yuv420p"]);
        command.args(["-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-movflags", "+faststart"]);
        command.args(["-f", "mp4", "-y"]).arg(file);
        let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
        let mut child = child.with_context(|| format!("{} does not start", program.display()))?;
        let pictures = child.stdin.take();
        Ok(Coder { child, pictures })
    }

    /// Adds a picture.
    ///
    /// # Errors
    /// ffmpeg has ended; the error has its reason.
    pub(super) fn write(&mut self, rgb: &[u8]) -> anyhow::Result<()> {
        let written = self.pictures.as_mut().context("the film is closed")?.write_all(rgb);
        if written.is_err() { self.end() } else { Ok(()) }
    }

    /// Waits until the film is complete.
    ///
    /// # Errors
    /// ffmpeg failed; the error has its reason.
    pub(super) fn end(&mut self) -> anyhow::Result<()> {
        drop(self.pictures.take());
        let mut reason = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            let _ = stderr.read_to_string(&mut reason);
        }
        let status = self.child.wait().context("ffmpeg")?;
        if !status.success() {
            bail!("ffmpeg failed ({status}): {}", reason.trim());
        }
        Ok(())
    }
}

impl Drop for Coder {
    fn drop(&mut self) {
        if self.pictures.take().is_some() {
            // The film is not complete.
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}
