//! Teams from a CSV file, each with a token file.

use crate::harness::Official;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// A folder beside the server's data, with a CSV file.
struct Files {
    _folder: tempfile::TempDir,
    csv: PathBuf,
    tokens: PathBuf,
}

impl Files {
    fn of(csv: &str) -> Self {
        let folder = tempfile::TempDir::new().expect("temporary directory");
        let (file, tokens) = (folder.path().join("teams.csv"), folder.path().join("tokens"));
        fs::write(&file, csv).expect("written");
        Files { _folder: folder, csv: file, tokens }
    }

    /// Imports; what is printed, or the error.
    fn import(&self, cup: &Official) -> Result<String, String> {
        let path = |path: &Path| path.to_str().expect("a path").to_owned();
        let output = cup.admin(&["team", "import", &path(&self.csv), "--tokens", &path(&self.tokens)]);
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        if output.status.success() { Ok(text(&output.stdout)) } else { Err(text(&output.stderr)) }
    }

    fn token(&self, file: &str) -> String {
        fs::read_to_string(self.tokens.join(file)).expect("a token").trim().to_owned()
    }
}

/// The names and labels of the teams' live tokens.
fn live(cup: &Official) -> BTreeSet<(String, String)> {
    let tokens = cup.get("/v1/admin/tokens", &cup.organizer).json()["tokens"].clone();
    let rows = tokens.as_array().expect("rows").iter();
    let live = rows.filter(|row| row["team"].is_string() && row["revoked_unix_ms"].is_null());
    let text = |value: &Value| value.as_str().expect("text").to_owned();
    live.map(|row| (text(&row["team"]), text(&row["label"]))).collect()
}

#[tokio::test]
async fn each_team_gets_a_token_in_a_file_that_only_its_owner_reads() {
    for cup in Official::each().await {
        let names: Vec<String> = (1..=60).map(|k| format!("team {k}")).collect();
        let mut csv = "name,label,country\n\"..,/蟹\",Ana,IT\n-fast,,PE\n".to_owned();
        names.iter().for_each(|name| csv += &format!("{name},captain of {name},IT\n"));
        let files = Files::of(&csv);
        let said = files.import(&cup).expect("imports");
        assert_eq!(said.lines().filter(|line| line.contains(" added ")).count(), 62, "{said}");
        let teams = live(&cup);
        assert!(teams.contains(&("..,/蟹".into(), "Ana".into())), "{teams:?}");
        assert!(teams.contains(&("team 60".into(), "captain of team 60".into())), "{teams:?}");
        assert_eq!(teams.len(), 62);
        for entry in fs::read_dir(&files.tokens).expect("a folder").map(|entry| entry.expect("a file")) {
            let mode = entry.metadata().expect("metadata").permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{:?}", entry.path());
        }
        assert_eq!(fs::metadata(&files.tokens).expect("metadata").permissions().mode() & 0o777, 0o700);
        cup.open();
        let (_, welcome) = cup.greet(&files.token("%2E.%2C%2F蟹.token")).await;
        assert_eq!(welcome["team"], "..,/蟹", "{welcome}");

        // Again, with one more team: nothing else changes.
        fs::write(&files.csv, csv + "late,Luis,CL\n").expect("written");
        let said = files.import(&cup).expect("imports");
        assert_eq!(said.lines().filter(|line| line.contains(" kept ")).count(), 62, "{said}");
        assert_eq!(live(&cup).len(), 63);
        cup.greet(&files.token("late.token")).await;
    }
}

#[test]
fn all_errors_are_named_with_their_lines_and_nothing_is_changed() {
    let cup = Official::start();
    cup.team("crabs");
    let records = || cup.get("/v1/admin/audit", &cup.organizer).json()["records"].as_array().map(Vec::len);
    let before = records();
    let csv =
        "name,label\nCRABS,x\neels,x\neels,y\na\u{200b}b,x\n,x\nnewts,x,y\nnewts,la\u{200b}bel\ngood,x\n";
    let files = Files::of(csv);
    let error = files.import(&cup).expect_err("refused");
    for part in [
        "6 errors; nothing was changed",
        "teams.csv:2: `CRABS`: looks like the team `crabs`",
        "teams.csv:4: `eels`: it is there twice",
        "teams.csv:5: `a\\u{200B}b`: name: character 2 is U+200B",
        "teams.csv:6: ``: name: it has 0 characters",
        "teams.csv:7: it has 3 columns, the head 2",
        "teams.csv:8: `newts`: label: character 3 is U+200B",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(!error.contains(":9:") && !files.tokens.exists(), "{error}");
    assert_eq!(records(), before);
}

#[tokio::test]
async fn an_interrupted_import_is_completed() {
    let cup = Official::start();
    let files = Files::of("name,label\nfirst,a\nsecond,b\nthird,c\nelsewhere,d\n");
    // The program was killed after it had added `second`, before it wrote the token. `elsewhere` was added by hand.
    let lost = cup.team("second");
    let by_hand = cup.team("elsewhere");
    fs::create_dir(&files.tokens).expect("a folder");
    fs::write(files.tokens.join("second.token"), "").expect("written");
    fs::write(files.tokens.join("third.token"), "").expect("written");
    let said = files.import(&cup).expect("imports");
    let lines: Vec<&str> = said.lines().collect();
    for (line, word) in lines[1..].iter().zip([" added ", " completed ", " added ", " kept, no token file;"])
    {
        assert!(line.contains(word), "{said}");
    }
    cup.open();
    for file in ["first.token", "second.token", "third.token"] {
        cup.greet(&files.token(file)).await;
    }
    assert_eq!(cup.refused(cup.handshake("/v1/control", &lost)).await, 401);
    cup.greet(&by_hand).await;
    assert!(!files.tokens.join("elsewhere.token").exists());
    // A token of another event is not overwritten.
    let other = Official::start();
    let error = files.import(&other).expect_err("refused");
    assert!(error.contains("teams.csv:2: `first`: ") && error.contains("there is no such team"), "{error}");
}

#[test]
fn a_new_token_keeps_the_label_of_the_last() {
    let cup = Official::start();
    cup.order("team/add", json!({"team": "crabs", "label": "Ana"}));
    cup.order("team/rotate", json!({"team": "crabs"}));
    assert_eq!(live(&cup), BTreeSet::from([("crabs".into(), "Ana".into())]));
    cup.order("team/rotate", json!({"team": "crabs", "label": "Luis"}));
    assert_eq!(live(&cup), BTreeSet::from([("crabs".into(), "Luis".into())]));
}
