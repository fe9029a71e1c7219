//! xacro: the `xacro` program, as ROS has it or as the Python package, turns macros into URDF.
//!
//! xacro evaluates Python expressions of the file; it is run only on a file that the user names.

use std::ffi::OsStr;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::reading::Reading;
use super::urdf;
use crate::decision::At;
use crate::draft::Draft;
use crate::error::ImportError;
use crate::glance::Glance;
use crate::source::limits;

/// Longest time that xacro may take.
const TIME: Duration = Duration::from_secs(60);

/// Runs the Python package with the packages of the source: `$(find NAME)` then needs no ROS.
const DRIVER: &str = r#"
import sys, types
folders = dict(entry.split("=", 1) for entry in sys.argv.pop(1).split("\n") if entry)
try:
    from ament_index_python.packages import get_package_share_directory as installed
except ImportError:
    def installed(name):
        raise KeyError(f"package '{name}' is neither in the source nor installed")
def find(name):
    return folders[name] if name in folders else installed(name)
for name in ("ament_index_python", "ament_index_python.packages"):
    module = sys.modules.setdefault(name, types.ModuleType(name))
    module.get_package_share_directory = find
    module.PackageNotFoundError = KeyError
try:
    import xacro
except ImportError:
    sys.exit(77)
sys.argv[0] = "xacro"
xacro.main()
"#;
/// Exit code of the driver if the package is not installed.
const NOT_INSTALLED: i32 = 77;

const INSTALL: &str = "is xacro, and no xacro is installed here: `python3 -m pip install xacro pyyaml`, or source a ROS \
                       installation that has it; or run xacro elsewhere and import the URDF";

/// Whether a file is a robot with macros; one with macros for other files has no name.
pub(super) fn is(file: &Glance<'_>) -> bool {
    let named = || file.tag.split_whitespace().any(|word| word == "name" || word.starts_with("name="));
    file.root == "robot" && file.text.contains("<xacro:") && named()
}

/// Reads a xacro file.
pub(super) fn read(reading: &mut Reading<'_>) -> Result<Draft, ImportError> {
    let arguments = &reading.options.xacro_arguments;
    let file = reading.log.file.clone();
    if !file.is_file() {
        return Err(ImportError::unreadable(file, "is xacro in an archive; unpack it and import the folder"));
    }
    if let Some(wrong) = arguments.iter().find(|argument| !argument.contains(":=")) {
        return Err(ImportError::unreadable(file, format!("--arg '{wrong}'; valid: NAME:=VALUE")));
    }
    let folders: Vec<String> = reading
        .source
        .packages()
        .filter_map(|(name, folder)| Some(format!("{name}={}", folder.canonicalize().ok()?.display())))
        .collect();
    let mut python = Command::new("python3");
    python.args(["-c", DRIVER, &folders.join("\n")]).arg(&file).args(arguments);
    let mut program = Command::new("xacro");
    program.arg(&file).args(arguments).env("ROS_PACKAGE_PATH", reading.source.root());
    // The package of a program that is installed for itself is in a Python of its own.
    let folders_of_programs = std::env::var_os("PATH").unwrap_or_default();
    let mut own = python_of("xacro", &folders_of_programs).map(|name| {
        let mut own = Command::new(name);
        own.args(["-c", DRIVER, &folders.join("\n")]).arg(&file).args(arguments);
        own
    });
    let mut output = None;
    for command in [Some(&mut python), own.as_mut(), Some(&mut program)].into_iter().flatten() {
        match run(command, &file)? {
            Some(Output { code, .. }) if code == Some(NOT_INSTALLED) => {}
            Some(found) => {
                output = Some(found);
                break;
            }
            None => {}
        }
    }
    let Some(Output { code, text, errors }) = output else {
        return Err(ImportError::unreadable(file, INSTALL));
    };
    if code != Some(0) {
        let lines: Vec<&str> = errors.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let mut last = lines[lines.len().saturating_sub(3)..].join("; ");
        if last.contains("substitution argument") {
            last += "; --arg NAME:=VALUE states an argument";
        }
        return Err(ImportError::unreadable(file, format!("xacro refuses it: {last}")));
    }
    reading.log.taken(At::Hand, "robot", "xacro's macros are expanded");
    reading.text = text.into();
    urdf::read(reading)
}

/// The Python in the first line of a program in one of the folders.
fn python_of(program: &str, folders: &OsStr) -> Option<PathBuf> {
    let file =
        std::env::split_paths(folders).map(|folder| folder.join(program)).find(|file| file.is_file())?;
    let mut line = [0; 512];
    let length = std::fs::File::open(file).ok()?.read(&mut line).ok()?;
    let line = std::str::from_utf8(line[..length].split(|byte| *byte == b'\n').next()?).ok()?;
    let python = PathBuf::from(line.strip_prefix("#!")?.trim());
    (python.is_absolute() && python.is_file()).then_some(python)
}

struct Output {
    code: Option<i32>,
    text: String,
    errors: String,
}

/// Runs a program; `None` if it is not there.
fn run(command: &mut Command, file: &Path) -> Result<Option<Output>, ImportError> {
    let failed = |problem: String| ImportError::unreadable(file, format!("xacro {problem}"));
    let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = match spawned {
        Ok(child) => child,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(format!("cannot be started: {error}"))),
    };
    // Both pipes are read at once, or a full one would stop the program.
    let limit = limits().text_bytes;
    let reader = |pipe: Option<Box<dyn std::io::Read + Send>>| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            if let Some(pipe) = pipe {
                let _ = pipe.take(limit + 1).read_to_end(&mut bytes);
            }
            bytes
        })
    };
    let out = reader(child.stdout.take().map(|pipe| Box::new(pipe) as _));
    let errors = reader(child.stderr.take().map(|pipe| Box::new(pipe) as _));
    let start = Instant::now();
    let status = loop {
        match child.try_wait().map_err(|error| failed(error.to_string()))? {
            Some(status) => break status,
            None if start.elapsed() > TIME => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(failed(format!("takes longer than {} s", TIME.as_secs())));
            }
            None => std::thread::sleep(Duration::from_millis(10)),
        }
    };
    let text = out.join().unwrap_or_default();
    if text.len() as u64 > limit {
        return Err(failed(format!("writes more than {limit} bytes")));
    }
    let text = String::from_utf8(text).map_err(|error| failed(format!("writes no UTF-8: {error}")))?;
    let errors = String::from_utf8_lossy(&errors.join().unwrap_or_default()).into_owned();
    Ok(Some(Output { code: status.code(), text, errors }))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn the_python_of_a_program_is_in_its_first_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let (program, python) = (folder.path().join("xacro"), folder.path().join("python"));
        std::fs::write(&python, "").expect("written");
        let of = |first: &str| {
            std::fs::write(&program, format!("{first}\nimport xacro\n")).expect("written");
            python_of("xacro", folder.path().as_os_str())
        };
        assert_eq!(of(&format!("#!{}", python.display())), Some(python.clone()));
        assert_eq!(of("#!/nowhere/python3"), None);
        assert_eq!(of("#!/usr/bin/env python3"), None);
        assert_eq!(of("\u{7f}ELF"), None);
        assert_eq!(python_of("other", folder.path().as_os_str()), None);
    }
}
