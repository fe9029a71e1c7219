//! The pages, their files, and their requests to the server besides the leaderboard.

use crate::harness::{Client, Official, Server, get, request, send};
use serde_json::{Value, json};

const PAGES: [&str; 15] = [
    "/",
    "/live",
    "/live/ses_1",
    "/replay",
    "/replay/run_1",
    "/drive",
    "/hands",
    "/hands/softhand",
    "/teams/crabs",
    "/wall",
    "/admin",
    "/docs",
    "/docs/protocol",
    "/docs/search?q=%22%3E%3Cscript%3E",
    "/replay/%22%3E%3Cscript%3E",
];

#[test]
fn every_page_allows_nothing_but_what_comes_from_this_server() {
    let server = Server::start();
    for path in PAGES {
        let page = get(&server, path);
        assert_eq!(page.status, 200, "{path}");
        let header = |name: &str| {
            let line = page.head.lines().find_map(|line| line.strip_prefix(&format!("{name}: ")));
            line.unwrap_or_else(|| panic!("{path} has no {name}: {}", page.head)).to_owned()
        };
        assert!(header("content-type").starts_with("text/html"), "{path}");
        let policy = header("content-security-policy");
        assert!(policy.starts_with("default-src 'none';") && !policy.contains("unsafe"), "{path}: {policy}");
        for part in ["script-src 'self'", "connect-src 'self'", "base-uri 'none'", "frame-ancestors 'none'"] {
            assert!(policy.contains(part), "{path}: {policy}");
        }
        assert_eq!(header("referrer-policy"), "no-referrer", "{path}");
        assert_eq!(header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(header("cross-origin-opener-policy"), "same-origin", "{path}");
        for inline in ["<style", " style=", "<script>", "javascript:", " onclick"] {
            assert!(!page.body.contains(inline), "{path}: {inline}");
        }
        // Nothing is loaded from elsewhere; links of documents may lead there.
        let loaded = page.body.replace("<a href=\"", "<a to=\"");
        for address in loaded.split("href=\"").chain(loaded.split("src=\"")).skip(1) {
            let here = address.starts_with(['/', '#']) || address.starts_with("data:,");
            assert!(here || address.starts_with("<!DOCTYPE"), "{path}: {address}");
        }
    }
}

#[test]
fn files_of_the_pages_are_served_as_what_they_are() {
    let server = Server::start();
    let plain = get(&server, "/assets/plain.css");
    assert_eq!(plain.status, 200);
    assert!(plain.head.contains("content-type: text/css"), "{}", plain.head);
    let tag = plain.head.lines().find_map(|line| line.strip_prefix("etag: ")).expect("a tag").to_owned();
    let again = send(&server, "GET", "/assets/plain.css", &format!("If-None-Match: {tag}\r\n"), b"");
    assert_eq!((again.status, again.body.as_str()), (304, ""));
    for none in ["/assets/none.js", "/assets/..%2Fmanifest.json", "/assets/.."] {
        get(&server, none).assert_problem(404, "not_found");
    }

    let page = get(&server, "/live").body;
    let of_page = |mark: &str, end: &str| {
        let at = page.find(mark)? + mark.len();
        page[at..].split('"').next().filter(|address| address.ends_with(end)).map(str::to_owned)
    };
    let Some(script) = of_page("<script type=\"module\" src=\"", ".js") else {
        println!("SKIP: compiled without the viewer; `cargo xtask viewer` builds it");
        assert!(page.contains("cargo xtask viewer"), "{page}");
        return;
    };
    let style = of_page("rel=\"stylesheet\" href=\"", ".css").expect("a style sheet");
    for (address, kind) in [(&script, "javascript"), (&style, "text/css")] {
        let whole = get(&server, address);
        assert_eq!(whole.status, 200, "{address}");
        assert!(whole.head.contains("content-type: ") && whole.head.contains(kind), "{}", whole.head);
        assert!(whole.head.contains("immutable") && whole.head.contains("vary: accept-encoding"));
        assert!(!whole.head.contains("content-encoding"), "{}", whole.head);
        for coding in ["gzip", "br"] {
            let head = request_head(&server, address, coding);
            assert!(head.contains(&format!("content-encoding: {coding}")), "{head}");
            let length = |head: &str| {
                let line = head.lines().find_map(|line| line.strip_prefix("content-length: "));
                line.and_then(|length| length.trim().parse::<usize>().ok()).expect("a length")
            };
            assert!(length(&head) < length(&whole.head), "{head}");
        }
    }
}

#[test]
fn the_description_of_a_hand_is_compressed_for_those_who_take_it() {
    let server = Server::start();
    let length = |head: &str| {
        let line = head.lines().find_map(|line| line.strip_prefix("content-length: "));
        line.and_then(|length| length.trim().parse::<usize>().ok()).expect("a length")
    };
    let whole = get(&server, "/v1/hands/shadow");
    assert!(!whole.head.contains("content-encoding"), "{}", whole.head);
    let packed = request_head(&server, "/v1/hands/shadow", "gzip");
    assert!(
        packed.contains("content-encoding: gzip") && packed.contains("vary: accept-encoding"),
        "{packed}"
    );
    assert!(3 * length(&packed) < length(&whole.head), "{packed}");
}

/// The head of an answer in a coding.
fn request_head(server: &Server, address: &str, coding: &str) -> String {
    send(server, "HEAD", address, &format!("Accept-Encoding: {coding}\r\n"), b"").head
}

#[test]
fn a_browser_without_scripts_asks_again_and_one_with_them_does_not() {
    let server = Server::start();
    let page = get(&server, "/").body;
    let refresh = page.find("http-equiv=\"refresh\"").expect("a refresh");
    let noscript = page[..refresh].rfind("<noscript>").expect("within noscript");
    assert!(!page[noscript..refresh].contains("</noscript>"), "{page}");
}

fn ask(server: &Server, hand: &str, body: &Value) -> crate::harness::Response {
    send(server, "POST", &format!("/v1/hands/{hand}/equilibrium"), "", body.to_string().as_bytes())
}

#[test]
fn a_hand_rests_without_a_world() {
    let server = Server::start();
    let free = ask(&server, "softhand", &json!({"motors": [0.3]})).json();
    assert_eq!(free["law"], "closed_form", "{free}");
    let count = |answer: &Value, field: &str| answer[field].as_array().map_or(0, Vec::len);
    let hand = get(&server, "/v1/hands/softhand").json();
    assert_eq!(count(&free, "q"), count(&hand, "coordinates"));
    assert_eq!(count(&free, "links"), count(&hand, "links"));
    let tip = free["links"].as_array().and_then(|links| links.last()).expect("links").clone();
    let contact = json!({"link": tip["name"], "point": [0, 0, 0], "position": tip["position"]});
    let base = json!({"position": [0, 0, 0], "quat_xyzw": [0, 0, 0, 1]});
    let held =
        ask(&server, "softhand", &json!({"motors": [0.5], "base": base, "contacts": [contact]})).json();
    assert_eq!((count(&held, "reactions"), &held["law"]), (1, &json!("newton")), "{held}");
    assert!(held["reactions"][0]["gap"].as_f64().expect("m") < 1e-3, "{held}");
    ask(&server, "paw", &json!({"motors": [0.5]})).assert_problem(404, "unknown_hand");
    for wrong in [json!({"motors": []}), json!({"motors": [2]}), json!({}), json!({"motors": [0.5], "x": 1})]
    {
        ask(&server, "softhand", &wrong).assert_problem(400, "bad_request");
    }
    let foreign = "Origin: https://evil.example\r\n";
    send(&server, "POST", "/v1/hands/softhand/equilibrium", foreign, b"{}").assert_problem(403, "forbidden");
    request(&server, "GET", "/v1/hands/softhand/equilibrium").assert_problem(405, "bad_request");
}

/// A spectator's connection.
async fn viewer(cup: &Official) -> Client {
    let mut viewer = Client::connect_to(&cup.server, "/v1/watch").await;
    let reply = viewer.ask(json!({"op": "subscribe", "featured": true})).await;
    assert_eq!(reply["op"], "subscribed", "{reply}");
    viewer
}

/// The next announcement.
async fn announcement(viewer: &mut Client) -> Value {
    loop {
        let message = viewer.next().await;
        if message["op"] == "announcement" {
            return message;
        }
    }
}

#[tokio::test]
async fn an_announcement_is_kept_recorded_and_sent_to_viewers() {
    for cup in Official::each().await {
        let list = |cup: &Official| get(&cup.server, "/v1/announcements").json()["announcements"].clone();
        assert_eq!(list(&cup), json!([]));
        let team = cup.team("crabs");
        let body = json!({"text": "Lunch at noon.\nThe shelf stays open.", "reason": "it is eleven"});
        cup.post("/v1/admin/announcement", &team, &body).assert_problem(403, "forbidden");
        cup.post("/v1/admin/announcement", &cup.organizer, &json!({"text": "a\u{202e}b"}))
            .assert_problem(400, "bad_request");
        let shown = cup.order("announcement", body);
        assert_eq!(
            (&shown["id"], &shown["text"]),
            (&json!(1), &json!("Lunch at noon.\nThe shelf stays open."))
        );
        let records = cup.get("/v1/admin/audit", &cup.organizer).json()["records"].clone();
        let last = records.as_array().and_then(|records| records.last()).expect("records").clone();
        assert_eq!((&last["action"], &last["reason"]), (&json!("announcement"), &json!("it is eleven")));

        // The newest at the beginning, others as they come.
        let mut viewer = viewer(&cup).await;
        assert_eq!(announcement(&mut viewer).await["id"], 1);
        let said = cup.admin(&["announce", "蟹 first", "--reason", "they won"]);
        assert!(said.status.success(), "{said:?}");
        assert_eq!(announcement(&mut viewer).await["text"], "蟹 first");

        // It outlives the server.
        let cup = cup.crashed();
        let texts: Vec<Value> =
            list(&cup).as_array().expect("a list").iter().map(|shown| shown["text"].clone()).collect();
        assert_eq!(texts, ["蟹 first", "Lunch at noon.\nThe shelf stays open."]);
        assert_eq!(announcement(&mut self::viewer(&cup).await).await["id"], 2);
    }
}
