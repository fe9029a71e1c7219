//! The committed pages and pictures of docs/report are those that `palmares-compare page` makes of the JSON beside them.

use std::fs;
use std::path::Path;
use std::process::Command;

const FILES: [&str; 5] =
    ["report.json", "hands/report.json", "further/report.json", "grasps/grasps.json", "search/search.json"];

#[test]
fn committed_pages_are_those_of_their_json() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report");
    for file in FILES {
        let committed = docs.join(file);
        let folder = tempfile::tempdir().expect("a folder");
        let copy = folder.path().join(committed.file_name().expect("a file"));
        fs::copy(&committed, &copy).expect("a committed file");
        let mut page = Command::new(env!("CARGO_BIN_EXE_palmares-compare"));
        let status = page.arg("page").arg(&copy).status().expect("it starts");
        assert!(status.success(), "{file}: {status}");
        let mut pages = 0;
        for entry in fs::read_dir(folder.path()).expect("a folder") {
            let made = entry.expect("an entry").path();
            let name = made.file_name().expect("a file");
            let [made, there] = [&made, &committed.with_file_name(name)].map(|path| fs::read(path).ok());
            assert!(
                made == there,
                "{} beside {file} is not the one that `palmares-compare page docs/report/{file}` makes",
                name.display()
            );
            pages += usize::from(name == "README.md");
        }
        assert_eq!(pages, 1, "{file}");
    }
}
