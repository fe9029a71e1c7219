//! The commands of the guides for organizers and operators, and those in the heads of the deployment files, run as they are written.
//!
//! Each section of a guide has a server of its own, on the competition.toml of the guide. A command that cannot run here is in
//! [`NOT_RUN`] with the reason; a new one that is neither run nor listed fails the test.

use crate::hands_upload::claw;
use crate::harness::kubelet::repository;
use crate::harness::{Official, bearer, postgres_database, program, send};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

/// Commands that do not run in this test, and why.
const NOT_RUN: [(&str, &str); 29] = [
    (
        "palmares replay one.mcap --like other.mcap",
        "needs two recordings of minutes; the runs here have one tick, and those are not compared",
    ),
    ("cargo build --release -p palmares", "minutes; README's command, which cargo xtask docker runs"),
    ("ulimit -r 1", "needs root, and changes this shell alone"),
    (
        "docker compose -f compose.yaml -f deploy/compose.realtime.yaml up",
        "needs a Docker engine that may raise limits",
    ),
    (
        "cargo run --release -p palmares-tests --example load -- --sessions 30 --replay run.mcap",
        "minutes, on an idle machine",
    ),
    (
        "palmares serve --listen 0.0.0.0:8081 --data-dir practice",
        "serves until it is ended: a test of its own starts it",
    ),
    ("palmares serve --config competition.toml", "serves until it is ended: a test of its own starts it"),
    ("systemctl status palmares", "needs a service of systemd"),
    ("docker compose ps", "needs a Docker engine"),
    ("kubectl get pods", "needs a cluster"),
    ("kubectl apply --kustomize", "needs a cluster"),
    ("kubectl scale statefulset palmares --replicas=0", "needs a cluster"),
    ("cargo xtask fleet board", "minutes"),
    ("cargo xtask fleet chaos --hosts 3 --faults 40 --seed 1", "minutes, as root"),
    ("docker build --tag palmares .", "cargo xtask docker builds it"),
    ("docker build -t palmares .", "cargo xtask docker builds it"),
    ("docker run -p 8080:8080 -v palmares:/data palmares", "cargo xtask docker starts it with compose.yaml"),
    ("docker compose --file compose.postgres.yaml up --build --detach", "cargo xtask docker starts it"),
    (
        "docker compose --file compose.postgres.yaml exec palmares cat /data/organizer.token",
        "needs a Docker engine; cargo xtask docker looks at the file",
    ),
    (
        "docker run --rm --user 0 --volume \"$PWD/secrets:/secrets\" palmares keys /secrets --owner 10001",
        "cargo xtask docker --fleet runs it",
    ),
    (
        "docker compose --file compose.yaml --file compose.realtime.yaml up --detach",
        "needs a Docker engine that may raise limits",
    ),
    ("docker compose up --detach", "cargo xtask docker --fleet runs it"),
    ("docker compose exec h1 cat /run/secrets/organizer.token", "cargo xtask docker --fleet runs it"),
    (
        "docker run --rm --user 0 --volume \"$PWD/secrets:/secrets\" palmares keys /secrets",
        "needs a Docker engine; `palmares keys secrets` runs in its place",
    ),
    ("kubectl create namespace cup", "needs a cluster"),
    (
        "kubectl --namespace cup create secret generic palmares-keys --from-file=secrets",
        "runs with --dry-run=client",
    ),
    (
        "kubectl --namespace cup create secret tls palmares-tls --cert=certificate.crt --key=certificate.key",
        "runs with --dry-run=client",
    ),
    (
        "kubectl --namespace cup apply --kustomize .",
        "needs a cluster; the tests of the manifest start its pods",
    ),
    ("docker compose up --build", "cargo xtask docker starts compose.yaml"),
];

/// The programs that commands begin with.
const PROGRAMS: [&str; 24] = [
    "palmares",
    "curl",
    "export",
    "docker",
    "kubectl",
    "systemctl",
    "journalctl",
    "cargo",
    "ulimit",
    "pg_isready",
    "ps",
    "cat",
    "openssl",
    "printf",
    "echo",
    "cp",
    "cd",
    "du",
    "df",
    "pip",
    "python",
    "sh",
    "bash",
    "ssh",
];

/// The commands of `palmares admin`.
const ADMIN: [&str; 18] = [
    "status", "open", "close", "pause", "resume", "end", "reveal", "announce", "schedule", "team", "token",
    "session", "run", "hand", "export", "audit", "backup", "restore",
];

/// A command and the section that it is in.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    section: String,
    command: String,
}

/// A command without the comment behind it.
fn without_comment(line: &str) -> &str {
    line.find(" # ").or_else(|| line.find("   #")).map_or(line, |at| &line[..at]).trim()
}

fn first_word(command: &str) -> &str {
    command.split([' ', '=']).next().unwrap_or_default()
}

/// The texts between single backticks.
fn spans(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// The lines of a guide, those of a paragraph joined.
fn lines(guide: &str) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    let (mut in_block, mut in_text) = (false, false);
    for line in guide.lines() {
        let fence = line.trim_start().starts_with("```");
        let text =
            !in_block && !fence && !line.trim().is_empty() && !line.trim_start().starts_with(['#', '|']);
        match joined.last_mut() {
            Some(last) if text && in_text => *last += &format!(" {}", line.trim_start()),
            _ => joined.push(line.to_owned()),
        }
        in_block ^= fence;
        in_text = text;
    }
    joined
}

/// The commands of a guide: lines of code blocks without a language, and code in the text that begins with a program. In a cell of a
/// table, `palmares admin` is left out from the second command on, and everywhere under a heading that says so.
fn commands(guide: &str) -> Vec<Line> {
    let mut found: Vec<Line> = Vec::new();
    let (mut section, mut block, mut says_so) = (String::new(), None, false);
    let lines = lines(guide);
    let mut add = |section: &str, command: &str| {
        let line = Line { section: section.to_owned(), command: without_comment(command).to_owned() };
        if !found.contains(&line) {
            found.push(line);
        }
    };
    for line in lines.iter().map(String::as_str) {
        if let Some(language) = line.trim_start().strip_prefix("```") {
            block = if block.is_none() { Some((language.to_owned(), None)) } else { None };
            continue;
        }
        if let Some((language, table)) = &mut block {
            // A block without a language is of commands, or a CSV file.
            let csv = *table.get_or_insert_with(|| !line.contains(' ') && line.contains(','));
            if language.is_empty() && !csv && !line.trim().is_empty() {
                add(&section, line);
            }
            continue;
        }
        if line.starts_with('#') {
            section = line.trim_start_matches(['#', ' ']).to_owned();
            says_so = false;
        }
        says_so |= line.contains("after `palmares admin`") || line.contains("Put `palmares admin` before");
        let is_row = line.trim_start().starts_with('|');
        for cell in if is_row { line.split(" | ").collect() } else { vec![line] } {
            let mut admin = says_so && is_row;
            for span in spans(cell).filter(|span| !span.contains('→')) {
                admin |= is_row && span.starts_with("palmares admin ");
                // `palmares verify` is a command's name.
                let words = span.split(' ').count();
                // `export NAME=value` is the shell's.
                if admin && ADMIN.contains(&first_word(span)) && !span.contains('=') {
                    add(&section, &format!("palmares admin {span}"));
                } else if PROGRAMS.contains(&first_word(span))
                    && words > if span.starts_with("palmares ") { 2 } else { 1 }
                {
                    add(&section, span);
                }
            }
        }
    }
    // The name of a command of `palmares admin`.
    found.retain(|line| line.command != "export runs");
    found
}

/// The blocks of a guide in a language, or those that begin with a line.
fn block(guide: &str, begin: &str) -> String {
    let (_, rest) = guide.split_once(begin).unwrap_or_else(|| panic!("no {begin:?}"));
    let kept = begin.strip_prefix("```toml\n").unwrap_or(begin.strip_prefix("```\n").unwrap_or(begin));
    format!("{kept}{}", rest.split_once("```").expect("it ends").0)
}

fn guide(name: &str) -> String {
    fs::read_to_string(repository("docs").join(name)).expect(name)
}

/// A section's place: a server, teams, and the files that the guide names.
struct Place {
    cup: Official,
    work: TempDir,
    /// `export` commands so far.
    exported: String,
    /// Teams that played, with the ids of their session and run. Each command that changes one gets the next.
    played: Vec<(String, String)>,
    postgres: Option<String>,
}

impl Place {
    /// A server with these teams, and with those that have played a run.
    async fn prepare(organizers: &str, teams: &[&str], played: &[&str]) -> Self {
        let rules = block(organizers, "```toml\nname = ");
        let cup = Official::start_with(TempDir::new().expect("folder"), &rules, None, &[]);
        let work = TempDir::new().expect("folder");
        let path = |name: &str| work.path().join(name);
        std::os::unix::fs::symlink(cup.folder(), path("data")).expect("a link");
        fs::create_dir(path("bin")).expect("a folder");
        std::os::unix::fs::symlink(program(), path("bin/palmares")).expect("a link");
        fs::write(path("teams.csv"), block(organizers, "```\nname,label")).expect("written");
        fs::write(path("slots.csv"), block(organizers, "```\nteam,begins_at,ends_at")).expect("written");
        fs::write(path("claw.zip"), claw("claw")).expect("written");
        let mut place = Place { cup, work, exported: String::new(), played: Vec::new(), postgres: None };
        for team in teams {
            place.cup.team(team);
        }
        if !played.is_empty() {
            place.cup.open();
        }
        for team in played {
            place.play(team).await;
        }
        place
    }

    /// Lets a new team play one run.
    async fn play(&mut self, team: &str) {
        let token = self.cup.team(team);
        fs::write(self.work.path().join(format!("{team}.token")), &token).expect("written");
        let (mut client, welcome, obs) = self.cup.playing(&token).await;
        client.goes_on(0).await;
        let result = client.ask(json!({"op": "stop"})).await;
        assert_eq!(result["op"], "result", "{result}");
        self.cup.verified(&obs["run_id"]).await;
        let id = |value: &Value| value.as_str().expect("an id").to_owned();
        self.played.push((id(&welcome["session_id"]), id(&obs["run_id"])));
    }

    /// The id that a command means.
    fn id(&self, words: &[&str]) -> String {
        let list = |path: &str| self.cup.get(&format!("/v1/admin/{path}"), &self.cup.organizer).json();
        let text = |value: &Value| value.as_str().expect("an id").to_owned();
        match words {
            ["session", "pause" | "resume", ..] => self.played[0].0.clone(),
            ["session", "grant", ..] => self.played[1].0.clone(),
            ["session", "void", ..] => self.played[2].0.clone(),
            ["session", "end", ..] => self.played[3].0.clone(),
            ["run", "void" | "unvoid", ..] => self.played[4].1.clone(),
            ["run", ..] => self.played[0].1.clone(),
            ["token", ..] => {
                text(&list("tokens")["tokens"].as_array().expect("tokens").last().expect("one")["token_id"])
            }
            ["hand", ..] => {
                if list("hands")["hands"] == json!([]) {
                    let team = self.cup.team("claws");
                    let sent = send(&self.cup.server, "POST", "/v1/hands", &bearer(&team), &claw("claw"));
                    assert_eq!(sent.status, 201, "{}", sent.body);
                }
                text(&list("hands")["hands"][0]["hand_id"])
            }
            _ => panic!("which id? {words:?}"),
        }
    }

    /// The command with the names of this place.
    fn filled(&self, command: &str) -> String {
        let words: Vec<&str> = command.split(' ').collect();
        let mut filled: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        for word in &mut filled {
            match word.as_str() {
                "ID" => *word = self.id(&words[2..]),
                "KEY" => {
                    *word = self.cup.get("/v1/competition", &self.cup.organizer).json()["replay_key"]
                        .as_str()
                        .expect("a key")
                        .to_owned()
                }
                _ => {}
            }
        }
        let mut times = ["2027-05-04T12:00:00Z", "2027-05-04T12:30:00Z"].into_iter();
        for word in filled.iter_mut().filter(|word| *word == "TIME") {
            *word = times.next().expect("two times").to_owned();
        }
        let socket =
            self.postgres.as_deref().and_then(|url| url.split(['@', '/']).find(|part| part.contains("%2F")));
        filled
            .join(" ")
            .replace("127.0.0.1:8080", self.cup.server.address())
            .replace("HOST:8080", self.cup.server.address())
            .replace("postgres://…", self.postgres.as_deref().unwrap_or("postgres://…"))
            .replace("DATABASE", &socket.unwrap_or("DATABASE").replace("%2F", "/"))
            .replace("DATA/", "data/")
    }

    /// Runs a command.
    fn run(&mut self, command: &str) {
        let mut filled = self.filled(command);
        // They ask at a terminal; here they are a script's.
        if let ["palmares", "admin", "pause" | "resume" | "end" | "reveal", ..] =
            command.split(' ').collect::<Vec<_>>()[..]
        {
            filled += " --yes";
        }
        if command.contains("schedule move crabs") {
            // The team has one slot again: a command before has added a second.
            let again = self.shell("palmares admin schedule import slots.csv --reason again");
            assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
        }
        if first_word(command) == "export" {
            self.exported += &format!("{filled}; ");
        }
        let output = self.shell(&format!("{}{filled}", self.exported));
        let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        assert!(output.status.success(), "`{command}`\nas `{filled}`\n{}: {said}", output.status);
    }

    fn shell(&self, line: &str) -> Output {
        let path = format!(
            "{}:{}",
            self.work.path().join("bin").display(),
            std::env::var("PATH").unwrap_or_default()
        );
        let mut shell = Command::new("bash");
        shell.args(["-c", line]).current_dir(self.work.path()).env("PATH", path).env_remove("DATABASE_URL");
        shell.env("PALMARES_URL", format!("http://{}", self.cup.server.address()));
        shell.env("PALMARES_TOKEN_FILE", "data/organizer.token");
        shell.stdin(Stdio::null()).output().expect("bash runs")
    }
}

/// Runs the commands of a guide and returns their number. A section has a place of its own, with runs of teams if it is among `playing`;
/// without such sections the guide has one place.
async fn follow(name: &str, playing: &[&str]) -> usize {
    let (organizers, text) = (guide("organizers.md"), guide(name));
    let (mut place, mut section, mut ran): (Option<Place>, _, _) = (None, String::new(), 0);
    for line in commands(&text) {
        if NOT_RUN.iter().any(|(command, _)| *command == line.command) {
            continue;
        }
        if section != line.section && !playing.is_empty() {
            place = None;
        }
        section = line.section;
        let place = match &mut place {
            Some(place) => place,
            none => {
                // Each command that changes a session or a run has one of its own.
                let played = match section.as_str() {
                    "When something goes wrong" => &["crabs", "rays", "eels", "squids", "snails"][..],
                    _ if playing.is_empty() => &["crabs", "rays", "eels", "squids", "snails"],
                    section if playing.contains(&section) => &["crabs"],
                    _ => &[],
                };
                let teams =
                    if ["Time slots", "The day"].contains(&&*section) { &["crabs", "rays"][..] } else { &[] };
                none.insert(Place::prepare(&organizers, teams, played).await)
            }
        };
        let on_postgres = line.command.contains("postgres://…") || line.command.contains("DATABASE");
        if on_postgres && place.postgres.is_none() {
            place.postgres = postgres_database().await;
        }
        if on_postgres && place.postgres.is_none() || !installed(first_word(&line.command)) {
            println!("LEFT OUT {name}: `{}`: not installed here", line.command);
            continue;
        }
        // The two ways to restore are alternatives.
        let _ = fs::remove_dir_all(place.work.path().join("restored"));
        place.run(&line.command);
        ran += 1;
    }
    ran
}

/// Whether a shell finds a command.
fn installed(command: &str) -> bool {
    command == "palmares"
        || Command::new("bash")
            .args(["-c", &format!("type {command}")])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success())
}

#[tokio::test]
async fn the_commands_of_the_guide_for_organizers_run() {
    let playing = ["When something goes wrong", "Similar runs", "Teams' own hands", "The end", "Backup"];
    let ran = follow("organizers.md", &playing).await;
    assert!(ran > 60, "only {ran} commands");
}

#[tokio::test]
async fn the_commands_of_the_guide_for_operators_run() {
    let ran = follow("operations.md", &[]).await;
    assert!(ran > 8, "only {ran} commands");
}

#[test]
fn the_servers_of_the_guide_start_and_end() {
    let organizers = guide("organizers.md");
    let all = commands(&organizers);
    let servers: Vec<_> = all.iter().filter(|line| line.command.starts_with("palmares serve ")).collect();
    assert_eq!(servers.len(), 2, "{servers:?}");
    for line in servers {
        let folder = TempDir::new().expect("folder");
        fs::write(folder.path().join("competition.toml"), block(&organizers, "```toml\nname = "))
            .expect("written");
        let words = line.command.split(' ').skip(1).map(|word| word.replace("0.0.0.0:8081", "127.0.0.1:0"));
        let mut command = Command::new(program());
        command
            .args(words)
            .current_dir(folder.path())
            .env("PALMARES_LISTEN", "127.0.0.1:0")
            .env_remove("DATABASE_URL");
        let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("palmares runs");
        let mut said = String::new();
        BufReader::new(server.stdout.take().expect("piped")).read_line(&mut said).expect("a line");
        let ended = Command::new("kill").arg(server.id().to_string()).status();
        assert!(ended.expect("kill runs").success());
        assert!(said.starts_with("listening on http://127.0.0.1:"), "`{}`: {said:?}", line.command);
        assert!(server.wait().expect("it ends").success(), "`{}`", line.command);
    }
}

/// The heads of the deployment files, in the order of a reader who follows them.
const HEADS: [&str; 7] = [
    "Dockerfile",
    "compose.yaml",
    "compose.postgres.yaml",
    "deploy/compose.realtime.yaml",
    "deploy/fleet/compose.yaml",
    "deploy/fleet/compose.realtime.yaml",
    "deploy/kubernetes/palmares.yaml",
];

/// The commands in the head of a file: comment lines that are indented by three spaces, or code in its first line.
fn head(file: &str) -> Vec<String> {
    let text = fs::read_to_string(repository(file)).expect(file);
    let head: Vec<&str> = text.lines().take_while(|line| line.starts_with('#')).collect();
    let indented = head.iter().filter_map(|line| line.strip_prefix("#   "));
    let indented = indented.map(without_comment).filter(|line| PROGRAMS.contains(&first_word(line)));
    let in_text = spans(head.first().expect("a head")).filter(|span| PROGRAMS.contains(&first_word(span)));
    indented.chain(in_text).map(str::to_owned).collect()
}

#[test]
fn the_commands_in_the_heads_of_the_deployment_files_run() {
    let folder = TempDir::new().expect("folder");
    let copied = Command::new("cp").arg("-r").arg(repository("deploy")).arg(folder.path()).status();
    assert!(copied.expect("cp runs").success());
    let bin = folder.path().join("bin");
    fs::create_dir(&bin).expect("a folder");
    std::os::unix::fs::symlink(program(), bin.join("palmares")).expect("a link");
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let mut ran = 0;
    for file in HEADS {
        let commands = head(file);
        assert!(!commands.is_empty(), "{file} has no commands in its head");
        let mut script = "set -e\n".to_owned();
        for command in &commands {
            let reason = NOT_RUN.iter().find(|(listed, _)| listed == command).map(|(_, reason)| *reason);
            if command.contains("palmares keys /secrets") {
                println!("LEFT OUT {file}: `{command}`: {}", reason.expect("listed"));
                script += "palmares keys secrets\n";
            } else if !installed(first_word(command)) {
                println!("LEFT OUT {file}: `{command}`: not installed here");
            } else if reason == Some("runs with --dry-run=client") {
                script += &format!("{command} --dry-run=client\n");
                ran += 1;
            } else if let Some(reason) = reason {
                println!("LEFT OUT {file}: `{command}`: {reason}");
            } else {
                script += &format!("{command}\n");
                ran += 1;
            }
        }
        // The manifest's certificate is made as the fleet's.
        let place = Path::new(file).parent().expect("a folder");
        let place = folder.path().join(if file.contains("kubernetes") { place } else { Path::new("") });
        if file.contains("kubernetes") {
            for name in ["certificate.crt", "certificate.key"] {
                fs::copy(folder.path().join("deploy/fleet").join(name), place.join(name))
                    .expect("made before");
            }
        }
        let shell =
            Command::new("bash").args(["-c", &script]).current_dir(&place).env("PATH", &path).output();
        let output = shell.expect("bash runs");
        assert!(output.status.success(), "{file}\n{script}\n{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(ran >= 6, "only {ran} commands");
}

#[test]
fn every_command_that_does_not_run_is_in_a_document() {
    let guides = ["organizers.md", "operations.md"].map(guide);
    let mut known: Vec<String> =
        guides.iter().flat_map(|text| commands(text)).map(|line| line.command).collect();
    known.extend(HEADS.iter().flat_map(|file| head(file)));
    for (command, _) in NOT_RUN {
        assert!(known.iter().any(|known| known == command), "{command} is in no document");
    }
}

#[test]
fn commands_are_found_in_blocks_tables_and_text() {
    let guide = "# A\n```\npalmares admin status   # now\n```\n```\nteam,at\ncrabs,1\n```\n\n| x | y |\n\
                 | `palmares admin team list`, `token list` | `status` |\nUse `curl http://x/y`, not `status`.\n## B\n\
                 | when | command (after `palmares admin`) |\n| now | `open --reason \"a\"`: publish `replay_key` |\n";
    let found: Vec<_> =
        commands(guide).into_iter().map(|line| format!("{}: {}", line.section, line.command)).collect();
    assert_eq!(
        found,
        [
            "A: palmares admin status",
            "A: palmares admin team list",
            "A: palmares admin token list",
            "A: curl http://x/y",
            "B: palmares admin open --reason \"a\"",
        ]
    );
}
