//! docs/senses.md has the tables of channels and images as they are declared.

use std::fs;
use std::path::Path;

/// Replaces the text between `<!-- NAME -->` and `<!-- /NAME -->`.
fn replaced(text: &str, name: &str, table: &str) -> String {
    let [begin, end] = [format!("<!-- {name} -->\n"), format!("<!-- /{name} -->")];
    let (before, rest) = text.split_once(&begin).expect("docs/senses.md marks where the table begins");
    let (_, after) = rest.split_once(&end).expect("docs/senses.md marks where the table ends");
    format!("{before}{begin}{table}{end}{after}")
}

#[test]
fn the_tables_of_the_document_are_those_of_the_declarations() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/senses.md");
    let there = fs::read_to_string(&path).expect("docs/senses.md can be read");
    let text = replaced(&there, "channels", &palmares_senses::document());
    let text = replaced(&text, "images", &palmares_senses::image_document());
    if std::env::var_os("PALMARES_WRITE_DOCS").is_some() {
        fs::write(&path, &text).expect("docs/senses.md can be written");
    } else {
        assert!(
            there == text,
            "docs/senses.md is not as declared; \
             `PALMARES_WRITE_DOCS=1 cargo test -p palmares-senses --test document` writes its tables"
        );
    }
}
