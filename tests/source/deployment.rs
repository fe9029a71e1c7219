//! The files in `deploy/` are valid for the programs that read them, where these are installed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs a program that checks a file; false, with the reason printed, if it is not installed.
fn accepts(program: &str, words: &[&str], file: &Path) -> bool {
    match Command::new(program).args(words).arg(file).output() {
        Err(_) => {
            println!("SKIP {}: {program} is not installed", file.display());
            false
        }
        Ok(output) => {
            let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
            assert!(output.status.success(), "{program} refuses {}:\n{said}", file.display());
            true
        }
    }
}

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy")
}

/// A copy of a file with other addresses, since names of hosts and certificates are not on this machine.
fn adapted(file: &str, folder: &Path, certificate: &str) -> PathBuf {
    let mut text = fs::read_to_string(deploy().join(file)).expect(file);
    for place in [
        "/usr/local/etc/haproxy/certificate.pem",
        "/etc/ssl/palmares/certificate.pem",
        "/etc/ssl/palmares/key.pem",
    ] {
        text = text.replace(place, certificate);
    }
    for host in ["h1", "h2", "h3"] {
        text = text.replace(&format!(" {host}:8080"), " 127.0.0.1:8080");
    }
    let path = folder.join(file.replace('/', "-"));
    fs::write(&path, text).expect("writes");
    path
}

/// A file with a certificate and its key.
fn certificate(folder: &Path) -> Option<String> {
    let (key, certificate, both) = (folder.join("key"), folder.join("cert"), folder.join("both.pem"));
    let words = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost"];
    let made = Command::new("openssl")
        .args(words)
        .args(["-keyout".as_ref(), key.as_os_str(), "-out".as_ref(), certificate.as_os_str()])
        .output();
    if !made.is_ok_and(|made| made.status.success()) {
        println!("SKIP proxies: openssl makes no certificate");
        return None;
    }
    let text = [certificate, key].map(|path| fs::read_to_string(path).expect("made"));
    fs::write(&both, text.concat()).expect("writes");
    Some(both.display().to_string())
}

#[test]
fn proxies_accept_their_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    if let Some(certificate) = certificate(folder) {
        let haproxy = adapted("haproxy/haproxy.cfg", folder, &certificate);
        accepts("haproxy", &["-q", "-c", "-f"], &haproxy);
        let site = adapted("nginx/palmares.conf", folder, &certificate);
        let nginx = folder.join("nginx.conf");
        let text = format!(
            "pid {0}/pid; error_log stderr; events {{}} http {{ access_log off; include {1}; }}",
            folder.display(),
            site.display()
        );
        fs::write(&nginx, text).expect("writes");
        accepts("nginx", &["-t", "-q", "-c"], &nginx);
    }
    accepts("caddy", &["validate", "--adapter", "caddyfile", "--config"], &deploy().join("caddy/Caddyfile"));
}

#[test]
fn prometheus_accepts_the_alerts() {
    accepts("promtool", &["check", "rules"], &deploy().join("monitoring/alerts.yaml"));
    accepts("promtool", &["check", "config"], &deploy().join("monitoring/prometheus.yaml"));
    let dashboard = fs::read_to_string(deploy().join("monitoring/dashboard.json")).expect("reads");
    let dashboard: serde_json::Value = serde_json::from_str(&dashboard).expect("JSON");
    assert!(dashboard["panels"].as_array().is_some_and(|panels| panels.len() > 8));
}

#[test]
fn kubectl_reads_the_manifests() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::copy(deploy().join("kubernetes/palmares.yaml"), folder.path().join("palmares.yaml")).expect("copies");
    fs::write(folder.path().join("kustomization.yaml"), "resources: [palmares.yaml]\n").expect("writes");
    accepts("kubectl", &["kustomize"], folder.path());
}
