//! The files in `deploy/` are valid for the programs that read them, where these are installed.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

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

/// A server that answers every request with 200; its port.
fn backend() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("bound").port();
    std::thread::spawn(move || {
        for socket in listener.incoming().flatten() {
            std::thread::spawn(move || {
                let head = BufReader::new(&socket).lines().map_while(Result::ok);
                if head.take_while(|line| !line.is_empty()).count() > 0 {
                    let ok = b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
                    // An error means that the proxy has gone.
                    let _ = (&socket).write_all(ok);
                }
            });
        }
    });
    port
}

/// A proxy that runs until this is dropped.
struct Proxy {
    process: Child,
    port: u16,
}

impl Drop for Proxy {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Proxy {
    /// Starts a proxy with a sample, without TLS and with a server of this test; none if the program is not installed.
    fn start(
        program: &str,
        folder: &Path,
        words: &[&str],
        file: &str,
        text: &str,
        tls: &str,
    ) -> Option<Self> {
        let sample = fs::read_to_string(deploy().join(file)).expect(file);
        let free = TcpListener::bind("127.0.0.1:0").expect("a port");
        let (port, server) = (free.local_addr().expect("bound").port(), backend());
        drop(free);
        assert!(sample.contains(tls), "{file} has no `{tls}`");
        let mut sample = sample.replace(tls, &text.replace("PORT", &port.to_string()));
        for address in ["h1:8080", "h2:8080", "h3:8080", "127.0.0.1:8080", "127.0.0.1:8081", "127.0.0.1:8082"]
        {
            sample = sample.replace(&format!(" {address}"), &format!(" 127.0.0.1:{server}"));
        }
        let path = folder.join(program);
        let sample = match program {
            // It refuses an upstream twice, and its sample is a file to be included.
            "caddy" => {
                let address = format!(" 127.0.0.1:{server}");
                "{\n\tadmin off\n}\n".to_owned() + &sample.replace(&address.repeat(3), &address)
            }
            "nginx" => {
                let site = folder.join("site.conf");
                let lines = sample.lines().filter(|line| !line.contains("ssl_certificate"));
                fs::write(&site, lines.collect::<Vec<_>>().join("\n")).expect("writes");
                let (pid, site) = (folder.join("pid"), site.display());
                format!(
                    "pid {}; daemon off; master_process off; error_log stderr; events {{}} \
                     http {{ access_log off; include {site}; }}",
                    pid.display()
                )
            }
            _ => sample,
        };
        fs::write(&path, sample).expect("writes");
        let mut started = Command::new(program);
        started.args(words).arg(&path).stdout(Stdio::null());
        // Caddy keeps files there.
        let started = started.env("XDG_DATA_HOME", folder).env("XDG_CONFIG_HOME", folder).spawn();
        match started {
            Ok(process) => Some(Proxy { process, port }),
            Err(_) => {
                println!("SKIP {file}: {program} is not installed");
                None
            }
        }
    }

    /// The status of the answer to a request.
    fn status(&mut self, path: &str) -> u16 {
        let began = Instant::now();
        let mut socket = loop {
            match TcpStream::connect(("127.0.0.1", self.port)) {
                Ok(socket) => break socket,
                Err(error) => {
                    let ended = self.process.try_wait().expect("its state");
                    assert!(
                        ended.is_none() && began.elapsed() < Duration::from_secs(20),
                        "{error} {ended:?}"
                    );
                    std::thread::sleep(Duration::from_millis(20));
                }
            }
        };
        let head = format!("GET {path} HTTP/1.1\r\nHost: cup.example.org\r\nConnection: close\r\n\r\n");
        socket.write_all(head.as_bytes()).expect("it reads");
        let mut answer = String::new();
        socket.read_to_string(&mut answer).expect("it answers");
        let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok());
        status.unwrap_or_else(|| panic!("{path}: {answer}"))
    }
}

/// Starts a proxy with its sample, in which `tls` becomes `text`: it passes on all but what is for other hosts.
fn passes_on(program: &str, folder: &Path, words: &[&str], file: &str, text: &str, tls: &str) {
    let Some(mut proxy) = Proxy::start(program, folder, words, file, text, tls) else { return };
    for path in ["/", "/v1/competition", "/v1/runs/internal"] {
        assert_eq!(proxy.status(path), 200, "{program} {path}");
    }
    for path in ["/v1/internal/watch/run_1", "/v1/%69nternal/watch/run_1", "/metrics"] {
        assert_eq!(proxy.status(path), 403, "{program} {path}");
    }
}

#[test]
fn haproxy_takes_its_file_and_passes_nothing_on_that_is_for_other_hosts() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, file) = (folder.path(), "haproxy/haproxy.cfg");
    if let Some(certificate) = certificate(folder) {
        accepts("haproxy", &["-q", "-c", "-f"], &adapted(file, folder, &certificate));
    }
    let tls = "    bind :443 ssl crt /usr/local/etc/haproxy/certificate.pem alpn http/1.1";
    passes_on("haproxy", folder, &["-q", "-db", "-f"], file, "    bind 127.0.0.1:PORT", tls);
}

#[test]
fn nginx_takes_its_file_and_passes_nothing_on_that_is_for_other_hosts() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, file) = (folder.path(), "nginx/palmares.conf");
    if let Some(certificate) = certificate(folder) {
        let site = adapted(file, folder, &certificate);
        let nginx = folder.join("nginx.conf");
        let text = format!(
            "pid {0}/pid; error_log stderr; events {{}} http {{ access_log off; include {1}; }}",
            folder.display(),
            site.display()
        );
        fs::write(&nginx, text).expect("writes");
        accepts("nginx", &["-t", "-q", "-c"], &nginx);
    }
    passes_on("nginx", folder, &["-q", "-c"], file, "listen 127.0.0.1:PORT", "listen 443 ssl");
}

#[test]
fn caddy_takes_its_file_and_passes_nothing_on_that_is_for_other_hosts() {
    let folder = tempfile::tempdir().expect("a folder");
    let (folder, file) = (folder.path(), "caddy/Caddyfile");
    accepts("caddy", &["validate", "--adapter", "caddyfile", "--config"], &deploy().join(file));
    let words = ["run", "--adapter", "caddyfile", "--config"];
    passes_on("caddy", folder, &words, file, "http://cup.example.org:PORT {", "cup.example.org {");
}

#[test]
fn prometheus_accepts_the_alerts() {
    accepts("promtool", &["check", "rules"], &deploy().join("monitoring/alerts.yaml"));
    accepts("promtool", &["check", "config"], &deploy().join("monitoring/prometheus.yaml"));
    accepts("promtool", &["test", "rules"], &played_alerts());
}

fn played_alerts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("source/alerts.test.yaml")
}

#[test]
fn every_alert_fires_in_a_test_and_is_silent_in_one() {
    let alerts = fs::read_to_string(deploy().join("monitoring/alerts.yaml")).expect("reads");
    let played = fs::read_to_string(played_alerts()).expect("reads");
    for alert in alerts.lines().filter_map(|line| line.trim().strip_prefix("- alert: ")) {
        assert!(played.contains(&format!("- alertname: {alert}\n")), "{alert} never fires");
        assert!(played.contains(&format!("- {{alertname: {alert}, ")), "{alert} is never silent");
    }
}

#[test]
fn the_dashboard_is_json_with_its_panels() {
    let dashboard = fs::read_to_string(deploy().join("monitoring/dashboard.json")).expect("reads");
    let dashboard: serde_json::Value = serde_json::from_str(&dashboard).expect("JSON");
    assert!(dashboard["panels"].as_array().is_some_and(|panels| panels.len() > 8));
}
