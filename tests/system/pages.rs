//! Web pages: those of other sites cannot use a practice server.

use crate::harness::{Server, handshake_to, send};
use tokio_tungstenite::connect_async;
use tokio_tungstenite::tungstenite::Error;

async fn opens(server: &Server, path: &str, headers: &[(&'static str, String)]) -> bool {
    let mut request = handshake_to(server, path, Some("palmares.v1.json"));
    for (name, value) in headers {
        request.headers_mut().insert(*name, value.parse().expect("a header"));
    }
    match connect_async(request).await {
        Ok(_) => true,
        Err(Error::Http(response)) => {
            assert_eq!(response.status(), 403);
            assert_eq!(response.headers()["content-type"], "application/problem+json");
            false
        }
        Err(other) => panic!("{other}"),
    }
}

#[tokio::test]
async fn sockets_open_for_programs_and_own_pages_only() {
    let server = Server::start_with(&["--allowed-origin", "https://cup.example.org"]);
    let port = server.address().rsplit_once(':').expect("a port").1.to_owned();
    for path in ["/v1/control", "/v1/watch"] {
        assert!(opens(&server, path, &[]).await, "a program");
        for own in [format!("http://{}", server.address()), format!("http://localhost:{port}")] {
            assert!(opens(&server, path, &[("origin", own.clone())]).await, "{own}");
        }
        assert!(opens(&server, path, &[("origin", "https://cup.example.org".into())]).await);
        for other in ["https://evil.example", "http://127.0.0.1:1", "null"] {
            assert!(!opens(&server, path, &[("origin", other.into())]).await, "{other}");
        }
        let renamed =
            [("host", format!("evil.example:{port}")), ("origin", format!("http://evil.example:{port}"))];
        assert!(!opens(&server, path, &renamed).await, "a name that leads here");
    }
}

#[test]
fn nobody_posts_for_another_site_or_under_another_name() {
    let server = Server::start_with(&["--allowed-host", "cup.example.org"]);
    let post = |headers: &str| send(&server, "POST", "/v1/hands?team=crabs", headers, b"no archive");
    post("").assert_problem(400, "bad_request");
    for headers in ["Origin: https://evil.example\r\n", "Sec-Fetch-Site: cross-site\r\n", "Origin: null\r\n"]
    {
        post(headers).assert_problem(403, "forbidden");
    }
    let named = |name: &str| {
        use std::io::{Read, Write};
        let mut stream = std::net::TcpStream::connect(server.address()).expect("connects");
        write!(stream, "GET /healthz HTTP/1.0\r\nHost: {name}\r\n\r\n").expect("sent");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("answer");
        answer
    };
    for name in ["localhost", "cup.example.org", "127.0.0.1"] {
        assert!(named(name).contains(" 200 "), "{name}: {}", named(name));
    }
    let refused = named("evil.example");
    assert!(refused.contains("403") && refused.contains("allowed_hosts"), "{refused}");
}
