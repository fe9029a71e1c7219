//! The file `competition.toml`.

use crate::parts::Seeds;

pub(crate) fn run(data: &[u8]) -> bool {
    std::str::from_utf8(data).is_ok_and(palmares_server::untrusted::competition)
}

pub(crate) fn seeds() -> Seeds {
    let practice = "mode = \"practice\"\n";
    let official = r#"name = "Cup"
mode = "official"
session_s = 1800.0
sessions_per_team = 2
reset_cost_s = 10
tasks = ["balls", "pan"]
task_files = ["own/task.toml"]
noise = "real"
sensors_only = ["grasp"]
hand_spread = true
scenes = "per_team"
hands = ["softhand"]
hand_files = ["own"]
listen = "[::1]:8080"
data_dir = "/var/lib/palmares"
database_url = "postgres://u:p@h/d"
storage = "s3://bucket/prefix"
seed_secret = "seed.secret"
signing_key = "signing.key"
max_worlds = 64
max_connections = 256
max_connections_per_team = 8
max_connections_per_address = 64
allowed_hosts = ["cup.example"]
allowed_origins = ["https://cup.example"]
trusted_proxies = ["10.0.0.0/8", "::1"]
max_requests_per_s = 500
resume_grace_s = 30
shutdown_grace_s = 30

[hand_limits]
mass_kg = 2.0
friction = 1.5
motors = 20

[fleet]
host = "a"
internal_url = "http://10.0.0.1:8080"
"#;
    vec![("practice.toml".into(), practice.into()), ("official.toml".into(), official.into())]
}
