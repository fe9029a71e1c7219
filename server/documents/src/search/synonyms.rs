//! Words for one subject. Readers bring words of other programs; the documents have one word for each.

use super::words::stem;
use std::collections::BTreeMap;

/// Words with one meaning here, a group a line.
const GROUPS: [&[&str]; 47] = [
    &["notebook", "jupyter", "ipynb", "jupyterlab", "colab", "ipython"],
    &["asyncio", "async", "await", "coroutine", "concurrency"],
    &["thread", "threading", "multithreading", "gil"],
    &["film", "video", "mp4", "movie", "gif", "clip", "screencast", "animation"],
    &["picture", "image", "screenshot", "png"],
    &["replay", "recording", "record", "mcap"],
    &["getting", "download", "fetch", "obtain", "save", "export"],
    &["install", "setup", "installation", "pip", "wheel", "requirements"],
    &["training", "learning", "reinforcement", "rl", "policy", "learn"],
    &["gymnasium", "gym", "openai", "environment", "env"],
    &["batch", "parallel", "vectorized", "vectorised", "vectorize"],
    &["pose", "position", "transform"],
    &["rotation", "quaternion", "quat", "orientation"],
    &["hand", "gripper", "effector"],
    &["motor", "actuator", "servo"],
    &["tactile", "touch", "taxel", "skin"],
    &["camera", "image", "depth", "rgb", "vision"],
    &["sensor", "senses", "sensing", "measurement"],
    &["noise", "error", "uncertainty"],
    &["reconnect", "reconnecting", "disconnect", "disconnected", "resume", "reconnection"],
    &["timeout", "deadline"],
    &["error", "exception", "refusal", "problem", "failure"],
    &["crash", "fault", "lost", "fail", "broken"],
    &["token", "password", "login", "auth", "authentication", "authorization", "credential"],
    &["leaderboard", "ranking", "rank", "scoreboard", "standings"],
    &["score", "points", "reward", "scoring"],
    &["websocket", "socket"],
    &["protocol", "wire", "api", "schema"],
    &["http", "rest", "endpoint", "openapi"],
    &["javascript", "js", "node", "typescript", "nodejs"],
    &["docker", "container", "compose", "podman"],
    &["kubernetes", "k8s", "kubectl", "helm"],
    &["host", "cluster", "fleet", "machines"],
    &["metrics", "prometheus", "monitoring", "alert", "monitor", "grafana"],
    &["proxy", "nginx", "haproxy", "traefik", "caddy", "certificate", "tls", "https", "ssl"],
    &["backup", "restore"],
    &["similar", "cheating", "cheat", "plagiarism", "copy"],
    &["realtime", "latency", "lateness"],
    &["speed", "performance", "fast", "slow", "overhead", "throughput", "cost"],
    &["engine", "simulator", "simulation", "physics"],
    &["step", "tick", "timestep"],
    &["import", "convert", "converter"],
    &["mjcf", "mujoco", "xml"],
    &["seed", "random", "reproducible", "deterministic", "determinism"],
    &["example", "tutorial", "sample", "quickstart"],
    &["slot", "schedule", "timetable", "calendar"],
    &["begin", "start", "started", "first"],
];

/// The stems of the words that mean the same as a stem, by this stem.
pub(super) fn of_stems() -> BTreeMap<String, Vec<String>> {
    let mut all: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for group in GROUPS {
        let stems: Vec<String> = group.iter().map(|word| stem(word)).collect();
        for one in &stems {
            let others = all.entry(one.clone()).or_default();
            others.extend(stems.iter().filter(|other| *other != one).cloned());
            others.sort();
            others.dedup();
        }
    }
    all
}

/// All words of the groups.
pub(super) fn all_words() -> impl Iterator<Item = &'static str> {
    GROUPS.iter().flat_map(|group| group.iter().copied())
}
