use super::*;
use crate::render::gif_file::GifFile;
use clap::Parser;

#[derive(Parser)]
struct Line {
    #[command(flatten)]
    options: RenderOptions,
}

fn options(line: &str) -> Result<RenderOptions, String> {
    let words = std::iter::once("render").chain(line.split(' '));
    Line::try_parse_from(words).map(|line| line.options).map_err(|error| error.to_string())
}

#[test]
fn pictures_are_at_equal_times_of_the_part() {
    let of = |line: &str, kind: OutputFormat| {
        ticks(&options(line).expect("valid"), kind, 0.01, 300).map_err(|error| error.to_string())
    };
    assert_eq!(of("a.mcap -o a.mp4 --fps 1", OutputFormat::Mp4), Ok(vec![0, 100, 200, 300]));
    assert_eq!(of("a.mcap -o a.mp4 --fps 1 --from 1 --to 2.5", OutputFormat::Mp4), Ok(vec![100, 200]));
    assert_eq!(of("a.mcap -o a.mp4 --fps 2 --speed 4 --from 0.5", OutputFormat::Mp4), Ok(vec![50, 250]));
    // Slower than the ticks: a moment is shown several times.
    assert_eq!(
        of("a.mcap -o a.mp4 --fps 50 --speed 0.25 --to 0.02", OutputFormat::Mp4),
        Ok(vec![0, 1, 1, 2, 2])
    );
    assert_eq!(of("a.mcap -o a.png", OutputFormat::Png), Ok(vec![300]));
    assert_eq!(of("a.mcap -o a.png --from 0.5", OutputFormat::Png), Ok(vec![50]));
    assert_eq!(
        of("a.mcap -o a.png --from 5", OutputFormat::Png),
        Err("--from 5: the run ends after 3 s".into())
    );
}

#[test]
fn wrong_options_are_refused_with_the_right_ones() {
    for (line, wanted) in [
        ("a.mcap -o a.mp4 --size 640", "width and height in pixels, such as 640x480"),
        ("a.mcap -o a.mp4 --fps 0", "more than 0, at most 120"),
        ("a.mcap -o a.mp4 --eye 1,2 --target 0,0,0", "three numbers, such as 0.4,-0.5,0.3"),
        ("a.mcap -o a.mp4 --eye 1,2,3", "--target"),
        ("a.mcap -o a.mp4 --eye 1,2,3 --target 0,0,0 --camera top", "cannot be used with"),
        ("a.mcap", "--output"),
    ] {
        let refused = options(line).expect_err(line);
        assert!(refused.contains(wanted), "{line}: {refused}");
    }
    let refused = |line: &str| render(&options(line).expect(line)).expect_err(line).to_string();
    assert_eq!(refused("a.mcap -o a.avi"), "--output a.avi: the name must end in .mp4, .gif or .png");
    assert_eq!(refused("a.mcap -o a.gif --fps 60"), "--fps 60: a .gif shows at most 50 pictures in a second");
    assert_eq!(refused("a.mcap -o a.gif --from 2 --to 1"), "--from 2 --to 1: wanted an end after the begin");
    // Whatever else is missing, such as ffmpeg: the file is what a person has misspelt.
    for film in ["a.gif", "a.mp4", "a.png"] {
        assert!(refused(&format!("no_such.mcap -o {film}")).starts_with("cannot read no_such.mcap"));
    }
}

#[test]
fn a_film_that_cannot_be_written_is_refused_and_one_that_is_there_stays() {
    let folder = std::env::temp_dir().join(format!("palmares-render-{}", std::process::id()));
    let refused = files::check_writable(&folder.join("a.gif")).expect_err("no folder").to_string();
    assert!(refused.starts_with("cannot write ") && refused.ends_with("a.gif"), "{refused}");
    std::fs::create_dir(&folder).expect("a folder");
    let (new, old) = (folder.join("new.gif"), folder.join("old.gif"));
    std::fs::write(&old, "mine").expect("written");
    let checked = [files::check_writable(&new), files::check_writable(&old)];
    assert!(checked.iter().all(Result::is_ok), "{checked:?}");
    assert!(!new.exists());
    assert_eq!(std::fs::read_to_string(&old).expect("it is there"), "mine");
    let _ = std::fs::remove_dir_all(&folder);
}

/// A decoder puts the same pictures together, close to the colours of the original.
#[test]
fn a_gif_has_all_pictures_and_their_times() {
    let (width, height) = (40_usize, 30_usize);
    let picture = |k: usize| -> Vec<u8> {
        let pixel = |u: usize, v: usize| {
            if u.abs_diff(4 * k + 4) < 4 && v.abs_diff(15) < 4 {
                [200, 40, 40]
            } else {
                [90 + 2 * v as u8, 120, 150]
            }
        };
        (0..width * height).flat_map(|at| pixel(at % width, at / width)).collect()
    };
    let path = std::env::temp_dir().join(format!("palmares-{}.gif", std::process::id()));
    let mut file = GifFile::create(&path, (width as u32, height as u32), 30.0).expect("small");
    (0..6).for_each(|k| file.write(&picture(k)).expect("written"));
    file.finish().expect("written");
    let bytes = std::fs::read(&path).expect("it is there");
    let _ = std::fs::remove_file(&path);
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(&bytes[..]).expect("a GIF");
    let (mut canvas, mut delays) = (vec![0; 4 * width * height], Vec::new());
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        let k = delays.len();
        delays.push(frame.delay);
        for (pixel, new) in canvas.chunks_exact_mut(4).zip(frame.buffer.chunks_exact(4)) {
            if new[3] > 0 {
                pixel.copy_from_slice(new);
            }
        }
        let wanted = picture(k);
        let far = canvas.chunks_exact(4).zip(wanted.chunks_exact(3)).filter(|(shown, wanted)| {
            shown.iter().zip(*wanted).any(|(shown, wanted)| shown.abs_diff(*wanted) > 40)
        });
        assert_eq!(far.count(), 0, "picture {k}");
    }
    assert_eq!(delays, [3, 4, 3, 3, 4, 3]);
}
