//! deploy/kubernetes: the pods start as they are written, without a cluster.

use crate::harness::kubelet::{Manifests, Pod, unable};
use crate::harness::{postgres_database, program};
use serde_json::{Value, json};
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// The files of an organizer before the first `kubectl apply`.
struct Prepared {
    manifests: Manifests,
    /// The folder of the database's socket.
    socket: PathBuf,
    /// The folder of the keys.
    keys: TempDir,
}

impl Prepared {
    fn token(&self) -> PathBuf {
        self.keys.path().join("organizer.token")
    }

    fn start(&self, number: u32) -> Pod {
        self.manifests.start(number, &self.socket)
    }
}

/// Follows the head of deploy/kubernetes/palmares.yaml; None where pods cannot be started, with the reason printed.
async fn prepared(folder: &str) -> Option<Prepared> {
    if let Some(why) = unable() {
        println!("SKIP {folder}: {why}");
        return None;
    }
    let mut manifests = Manifests::of(folder)?;
    let url = postgres_database().await?;
    let host = url.split(['@', '/']).find(|part| part.contains("%2F")).expect("a socket's folder");
    let socket = PathBuf::from(host.replace("%2F", "/"));
    // The pod's account reaches it.
    fs::set_permissions(&socket, Permissions::from_mode(0o711)).expect("root may");
    let keys = TempDir::new().expect("temporary directory");
    let made = Command::new(program()).arg("keys").arg(keys.path()).output().expect("palmares runs");
    assert!(made.status.success(), "{made:?}");
    manifests.create_secret("palmares-keys", keys.path());
    manifests.put_in("palmares", "DATABASE_URL", &url);
    Some(Prepared { manifests, socket, keys })
}

/// The answer of `palmares admin status`.
fn status(pod: &Pod, token: &Path) -> Value {
    let output = pod.admin(token, &["status"]);
    assert!(output.status.success(), "{}\n{}", String::from_utf8_lossy(&output.stderr), pod.log());
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[tokio::test]
async fn the_pods_start_and_keep_the_organizers_token() {
    let Some(cup) = prepared("deploy/kubernetes").await else { return };
    let (mut first, mut second) = (cup.start(0), cup.start(1));
    first.ready();
    second.ready();
    assert_eq!(first.status("Uid:"), ["10001"; 4]);
    assert_eq!(first.status("CapEff:"), ["0000000000000000"]);
    assert_eq!(first.status("NoNewPrivs:"), ["1"]);
    // As the kubelet makes them.
    assert_eq!(first.shell("stat -L -c '%a %u %g' /run/secrets/palmares/seed.secret"), "440 0 10001");
    for path in ["/probe", "/run/secrets/palmares/probe", "/etc/palmares/probe"] {
        assert!(first.shell(&format!("touch {path}")).contains("Read-only"), "{path} can be written");
    }
    // Every pod knows the organizer, also one whose volume is new.
    for pod in [&first, &second] {
        assert_eq!(status(pod, &cup.token())["name"], "Palmares Cup");
    }
    drop(first);
    let mut again = cup.start(0);
    again.ready();
    let opened = again.admin(&cup.token(), &["open", "--reason", "the pod is new"]);
    assert!(opened.status.success(), "{}", String::from_utf8_lossy(&opened.stderr));
    let tokens = again.admin(&cup.token(), &["--json", "token", "list"]);
    let tokens: Value = serde_json::from_slice(&tokens.stdout).expect("JSON");
    let rows = tokens["tokens"].as_array().expect("tokens");
    assert_eq!(rows.len(), 1, "one organizer, not one a start: {tokens}");
}

#[tokio::test]
async fn realtime_priority_is_an_overlay() {
    let Some(cup) = prepared("deploy/kubernetes-realtime").await else { return };
    let mut pod = cup.start(0);
    pod.ready();
    // Root with CAP_SYS_NICE alone; the keys are root's, and no group's.
    assert_eq!(pod.status("CapEff:"), ["0000000000800000"]);
    assert_eq!(pod.shell("stat -L -c '%a %u' /run/secrets/palmares/seed.secret"), "400 0");
    assert!(!pod.log().contains("no realtime priority"), "{}", pod.log());
    let realtime = |policies: Vec<u64>| policies.into_iter().filter(|policy| matches!(policy, 1 | 2)).count();
    assert!(realtime(pod.policies()) > 0, "no thread has realtime priority");
    let Some(plain) = prepared("deploy/kubernetes").await else { return };
    let mut plain = plain.start(0);
    plain.ready();
    assert_eq!(realtime(plain.policies()), 0, "the overlay changes nothing here");
}

#[tokio::test]
async fn a_pod_refuses_keys_that_others_can_read() {
    let Some(mut cup) = prepared("deploy/kubernetes").await else { return };
    cup.manifests.with_mode("keys", 0o444);
    let said = cup.start(0).ended();
    assert!(said.contains("seed.secret: its mode is 444, others may access it"), "{said}");
}

/// A policy, a service and a set agree on their pods and port.
#[test]
fn only_the_hosts_the_ingress_and_prometheus_reach_a_pod() {
    let Some(manifests) = Manifests::of("deploy/kubernetes") else { return };
    let set = manifests.object("StatefulSet");
    let labels = &set["spec"]["template"]["metadata"]["labels"];
    let policy = &manifests.object("NetworkPolicy")["spec"];
    assert_eq!(&policy["podSelector"]["matchLabels"], labels);
    assert_eq!(policy["policyTypes"], json!(["Ingress"]));
    let rules = policy["ingress"].as_array().expect("rules");
    assert_eq!(rules.len(), 1);
    assert_eq!(rules[0]["ports"], json!([{"protocol": "TCP", "port": "http"}]));
    for peer in rules[0]["from"].as_array().expect("an empty list lets everybody in") {
        let labels = peer["podSelector"]["matchLabels"].as_object();
        assert!(labels.is_some_and(|labels| !labels.is_empty()), "any pod: {peer}");
    }
    // Its headless service, which gives the pods their names.
    let name = &set["spec"]["serviceName"];
    let service = manifests.named("Service", name.as_str().expect("a name"));
    assert_eq!(service["spec"]["clusterIP"], "None");
    assert_eq!(&service["spec"]["selector"], labels);
    // A changed competition.toml has another name, so that the pods start anew.
    let volumes = set["spec"]["template"]["spec"]["volumes"].as_array().expect("volumes");
    let config = volumes.iter().find_map(|volume| volume["configMap"]["name"].as_str()).expect("a ConfigMap");
    assert!(config.starts_with("palmares-") && config.len() == "palmares-".len() + 10, "{config}");
}

#[test]
fn an_ingress_passes_nothing_on_that_is_for_other_hosts() {
    let Some(manifests) = Manifests::of("deploy/kubernetes") else { return };
    let paths = &manifests.object("Ingress")["spec"]["rules"][0]["http"]["paths"];
    let backend = |path: &str, kind: &str| {
        let mut rules = paths.as_array().expect("paths").iter();
        let rule = rules.find(|rule| rule["path"] == path).unwrap_or_else(|| panic!("no rule for {path}"));
        assert_eq!(rule["pathType"], kind, "{path}");
        rule["backend"]["service"]["name"].as_str().expect("a name").to_owned()
    };
    for (path, kind) in [("/v1/internal", "Prefix"), ("/metrics", "Exact")] {
        let service = manifests.named("Service", &backend(path, kind));
        assert!(service["spec"]["selector"].is_null(), "{path}: the service has pods");
    }
    let service = manifests.named("Service", &backend("/", "Prefix"));
    assert_eq!(
        &service["spec"]["selector"],
        &manifests.object("StatefulSet")["spec"]["selector"]["matchLabels"]
    );
}
