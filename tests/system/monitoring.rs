//! Prometheus with the configurations of deploy/monitoring scrapes a real server. `tests/source` plays the alerts.

use crate::harness::kubelet::{Manifests, repository};
use crate::harness::{Server, fleet::free_port};
use serde_json::Value;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A Prometheus until this is dropped.
struct Prometheus {
    process: Child,
    port: u16,
    _folder: TempDir,
}

impl Drop for Prometheus {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A file of deploy/monitoring.
fn shipped(name: &str) -> String {
    fs::read_to_string(repository("deploy/monitoring").join(name)).expect(name)
}

/// Replaces a part that must be there.
fn replaced(text: &str, part: &str, by: &str) -> String {
    assert!(text.contains(part), "no {part:?} in\n{text}");
    text.replace(part, by)
}

impl Prometheus {
    /// Starts one with a configuration, and the alerts and more files beside it; None if it is not installed, with the reason printed.
    fn start(config: &str, files: &[(&str, &str)]) -> Option<Self> {
        let folder = TempDir::new().expect("folder");
        // A test does not wait for the usual interval.
        let config = replaced(config, "scrape_interval: 5s", "scrape_interval: 250ms");
        let config = replaced(&config, "evaluation_interval: 5s", "evaluation_interval: 250ms");
        let alerts = shipped("alerts.yaml");
        for (name, text) in [("prometheus.yaml", &*config), ("alerts.yaml", &*alerts)].iter().chain(files) {
            fs::write(folder.path().join(name), text).expect("written");
        }
        let port = free_port();
        let mut command = Command::new("prometheus");
        command.arg(format!("--web.listen-address=127.0.0.1:{port}"));
        command
            .args(["--config.file=prometheus.yaml", "--storage.tsdb.path=data"])
            .current_dir(folder.path());
        match command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn() {
            Ok(process) => Some(Prometheus { process, port, _folder: folder }),
            Err(_) => {
                println!("SKIP: prometheus is not installed");
                None
            }
        }
    }

    /// The answer to a GET, if there is one.
    fn get(&self, path: &str) -> Option<Value> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).ok()?;
        write!(stream, "GET {path} HTTP/1.0\r\nHost: localhost\r\n\r\n").ok()?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).ok()?;
        serde_json::from_str(answer.split_once("\r\n\r\n")?.1).ok()
    }

    /// The series of an expression: labels and value.
    fn query(&self, expression: &str) -> Vec<(Value, String)> {
        let escaped: String = expression.bytes().map(|byte| format!("%{byte:02X}")).collect();
        let answer = self.get(&format!("/api/v1/query?query={escaped}")).unwrap_or_default();
        let series = answer["data"]["result"].as_array().cloned().unwrap_or_default();
        let value = |one: &Value| one["value"][1].as_str().unwrap_or_default().to_owned();
        series.into_iter().map(|one| (one["metric"].clone(), value(&one))).collect()
    }

    /// Waits until every series of an expression has a value, and there are as many.
    fn until(&mut self, expression: &str, values: &[&str]) -> Vec<(Value, String)> {
        let began = Instant::now();
        loop {
            let found = self.query(expression);
            if found.iter().map(|(_, value)| value.as_str()).eq(values.iter().copied()) {
                return found;
            }
            let ended = self.process.try_wait().expect("its state");
            assert!(
                ended.is_none() && began.elapsed() < Duration::from_secs(60),
                "{expression}: {found:?} {ended:?}"
            );
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// The alerts with faults in their expressions, once all have been evaluated.
    fn faulty(&self) -> Vec<String> {
        loop {
            let answer = self.get("/api/v1/rules").unwrap_or_default();
            let rules = answer["data"]["groups"][0]["rules"].as_array().cloned().unwrap_or_default();
            if !rules.is_empty() && rules.iter().all(|rule| rule["health"] != "unknown") {
                let faulty = rules.iter().filter(|rule| rule["health"] != "ok");
                return faulty.map(Value::to_string).collect();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

#[test]
fn prometheus_scrapes_the_hosts() {
    let server = Server::start();
    let config = replaced(&shipped("prometheus.yaml"), "h1:8080, h2:8080, h3:8080", server.address());
    let Some(mut prometheus) = Prometheus::start(&config, &[]) else { return };
    let up = prometheus.until("up{job=\"palmares\"}", &["1"]);
    assert_eq!(up[0].0["instance"], server.address());
    assert_eq!(prometheus.faulty(), Vec::<String>::new());
    // The metrics that the alerts count are there from the start.
    for metric in [
        "palmares_refusals_total{code=\"internal\"}",
        "palmares_verification_stuck",
        "palmares_uploads_waiting",
    ] {
        prometheus.until(metric, &["0"]);
    }
    // Before the first scrape it was pending.
    prometheus.until("ALERTS{alertname=\"NoHost\"}", &[]);
    drop(server);
    prometheus.until("up{job=\"palmares\"}", &["0"]);
    prometheus.until("ALERTS{alertname=~\"HostDown|NoHost\", alertstate=\"pending\"}", &["1", "1"]);
}

/// The targets that Prometheus makes of the manifest's pods, with the labels that it gives them. A pod's address is that of a server here.
fn targets(manifests: &Manifests, address: &str) -> String {
    let set = manifests.object("StatefulSet");
    let container = &set["spec"]["template"]["spec"]["containers"][0];
    let (name, port) = (set["metadata"]["name"].as_str().expect("a name"), &container["ports"][0]);
    let target = |port_name: &str, address: &str| {
        serde_json::json!({"targets": [address], "labels": {
            "__meta_kubernetes_namespace": "cup",
            "__meta_kubernetes_pod_name": format!("{name}-0"),
            "__meta_kubernetes_pod_label_app": set["spec"]["template"]["metadata"]["labels"]["app"],
            "__meta_kubernetes_pod_container_port_name": port_name,
        }})
    };
    // Another port of the pod, as a sidecar has one, is not ours.
    let other = target("proxy-admin", "127.0.0.1:9");
    serde_json::json!([target(port["name"].as_str().expect("a name"), address), other]).to_string()
}

#[test]
fn prometheus_scrapes_the_pods_of_a_cluster_under_the_same_job() {
    let Some(manifests) = Manifests::of("deploy/kubernetes") else { return };
    let server = Server::start();
    let shipped = shipped("prometheus-kubernetes.yaml");
    // It asks for the pods that the manifest makes.
    let config: Value = serde_yaml_ng::from_str(&shipped).expect("YAML");
    let discovery = &config["scrape_configs"][0]["kubernetes_sd_configs"][0];
    let labels = &manifests.object("StatefulSet")["spec"]["template"]["metadata"]["labels"];
    assert_eq!(
        discovery["selectors"][0]["label"],
        format!("app={}", labels["app"].as_str().expect("a label"))
    );
    // Debian's Prometheus knows no clusters, and there is none: the same targets come from a file.
    let (before, rest) = shipped.split_once("    kubernetes_sd_configs:").expect("its discovery");
    let (_, after) = rest.split_once("    relabel_configs:").expect("its labels");
    let config =
        format!("{before}    file_sd_configs: [{{files: [pods.json]}}]\n    relabel_configs:{after}");
    let pods = targets(&manifests, server.address());
    let Some(mut prometheus) = Prometheus::start(&config, &[("pods.json", &pods)]) else { return };
    let up = prometheus.until("up", &["1"]);
    assert_eq!(up[0].0, serde_json::json!({"__name__": "up", "instance": "palmares-0", "job": "palmares"}));
    // Before the first scrape it was pending.
    prometheus.until("ALERTS{alertname=\"NoHost\"}", &[]);
}
