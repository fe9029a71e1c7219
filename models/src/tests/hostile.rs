//! Hostile files: each is refused quickly, with file, element, value and limit.

use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;

use super::softhand::{SETTINGS, URDF};
use crate::error::ModelError;
use crate::read::{self, Files, Limits, LoadOptions, Loaded};

/// A base and a link that turns on it; `{…}` of the arguments are replaced.
const SMALL: &str = r#"<robot name="r">
  <link name="base"><inertial><origin xyz="0 0 0.01" rpy="0 0 0.1"/><mass value="0.5"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><origin xyz="0.01 0 0" rpy="0.2 0 0"/><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  <link name="tip"><inertial><mass value="0.1"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
    <collision><geometry><sphere radius="0.03"/></geometry></collision>
    <collision><geometry><cylinder radius="0.02" length="0.07"/></geometry></collision></link>
  <joint name="a" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.1" rpy="0 0 0.3"/>
    <axis xyz="0 1 0"/><limit lower="-0.25" upper="0.75" effort="7" velocity="8"/>
    <dynamics damping="0.6" friction="0"/></joint>
  <transmission name="t"><type>transmission_interface/AdaptiveSynergyTransmission</type><joint name="a">
    <mechanicalReduction>0.9</mechanicalReduction><mechanicalElasticity>0.8</mechanicalElasticity>
    <offset>0.05</offset></joint><actuator name="m"/></transmission>
</robot>"#;

const SMALL_SETTINGS: &str = "friction = 0.7\n[motors.m]\nscaling = 12.5\noffset = 0.1\nspeed_limit = 2\n\
    [tendons.t]\nstiffness = 300\ndamping = 0.4\nforce_limit = 2.5\n[coordinates.a]\nstiffness = 1.5\ndamping = 0.03\n\
    rest = 0.02\n[links.base]\nmass = 0.55\nrounding = 0.004\nfriction = 0.9\n";

fn read(urdf: &str, settings: Option<&str>) -> Result<Loaded, ModelError> {
    let settings = settings.map(|s| (Path::new("x/hand.toml"), s));
    read::from_text((Path::new("x/hand.urdf"), urdf), settings, None, &LoadOptions::default())
}

#[track_caller]
fn refused(result: Result<Loaded, ModelError>, parts: &[&str]) {
    let message = result.expect_err("it should be refused").to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

/// A chain of `n` links after the base.
fn chain(n: usize) -> String {
    let mut text = String::from("<robot name='r'><link name='l0'/>");
    for i in 0..n {
        let next = i + 1;
        text += &format!(
            "<link name='l{next}'/><joint name='j{i}' type='fixed'><parent link='l{i}'/><child link='l{next}'/></joint>"
        );
    }
    text + "</robot>"
}

/// Start and end of every number in a text, beginning with a digit or a minus.
fn numbers(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let part = |b: u8| b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'e');
    let begins = |i: usize| {
        let sign = usize::from(bytes[i] == b'-');
        bytes.get(i + sign).is_some_and(u8::is_ascii_digit)
            && (i == 0 || matches!(bytes[i - 1], b' ' | b'"' | b'>' | b'='))
    };
    let mut found = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        if begins(i) {
            let end = (i..bytes.len()).find(|&k| !part(bytes[k])).unwrap_or(bytes.len());
            found.push((i, end));
            i = end;
        }
        i += 1;
    }
    found
}

#[test]
fn the_small_hand_itself_loads() {
    read(SMALL, Some(SMALL_SETTINGS)).unwrap();
}

#[test]
fn entities_do_not_multiply() {
    let laughs = "<!DOCTYPE r [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;&a;'><!ENTITY c '&b;&b;&b;&b;'>]>\
                  <robot name='&c;'/>";
    refused(read(laughs, None), &["x/hand.urdf", "not valid XML"]);
}

#[test]
fn long_chains_and_tags_are_not_followed() {
    refused(read(&chain(4_000), None), &["x/hand.urdf: robot: 4001 links; the limit is 256"]);
    refused(read(&chain(10_000), None), &["x/hand.urdf", "the limit is"]);
    refused(read(&chain(100), None), &["link 'l64': 65 links in one chain; the limit is 64"]);
    let attributes: String = (0..60_000).map(|i| format!(" a{i}=''")).collect();
    let many = SMALL.replacen("<robot", &format!("<robot{attributes}"), 1);
    refused(read(&many, None), &["<robot>", "bytes in one tag; the limit is 16384"]);
    // A '>' in quotes does not end a tag, a long comment is no tag, and an unterminated tag does not hang.
    let quoted = SMALL.replacen("<robot", &format!("<robot a='>'{attributes}"), 1);
    refused(read(&quoted, None), &["bytes in one tag"]);
    read(&SMALL.replacen("<link", &format!("<!-- {} --><link", "<x ".repeat(10_000)), 1), None).unwrap();
    refused(read("<robot name='", None), &["not valid XML"]);
    let tendons: String = (0..65)
        .map(|i| {
            format!(
                "<transmission name='x{i}'><type>AdaptiveSynergyTransmission</type><joint name='a'/></transmission>"
            )
        })
        .collect();
    let many = SMALL.replacen("</robot>", &format!("{tendons}</robot>"), 1);
    refused(read(&many, None), &["transmission 'x63': 65 tendons up to here; the limit is 64"]);
    let centers = "[0.0, 0.0, 0.0],".repeat(1025);
    let patches = format!(
        "[[tactile]]\nname = 'p'\nlink = 'tip'\nalong = [1.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\n\
         size = [0.01, 0.01]\ncenters = [{centers}]"
    );
    refused(read(SMALL, Some(&patches)), &["x/hand.toml: tactile: 1025 taxels; the limit is 1024"]);
    let shapes = "<collision><geometry><sphere radius='0.01'/></geometry></collision>".repeat(33);
    let many = SMALL.replacen("</link>", &format!("{shapes}</link>"), 1);
    refused(read(&many, None), &["link 'base': 34 collision shapes; the limit is 32"]);
}

#[test]
fn every_number_is_checked() {
    // Nothing here reads `effort` and `velocity`, and a finite limit may have any value.
    let unread = ["7", "8"];
    let bounds = ["-0.25", "0.75"];
    for (from, to) in numbers(SMALL) {
        for bad in ["nan", "inf", "-inf", "1e308", "-1e308"] {
            let text = format!("{}{bad}{}", &SMALL[..from], &SMALL[to..]);
            let number = &SMALL[from..to];
            match read(&text, Some(SMALL_SETTINGS)) {
                Err(error) => {
                    let message = error.to_string();
                    assert!(message.starts_with("x/hand.urdf: "), "{message}");
                }
                Ok(_) => assert!(
                    unread.contains(&number) || (bounds.contains(&number) && bad.contains("1e308")),
                    "{bad} instead of {number} at {from} was taken"
                ),
            }
        }
    }
    for (from, to) in numbers(SMALL_SETTINGS) {
        for bad in ["nan", "inf", "-inf", "1e308", "-1e308"] {
            let text = format!("{}{bad}{}", &SMALL_SETTINGS[..from], &SMALL_SETTINGS[to..]);
            let message = read(SMALL, Some(&text)).expect_err(&text).to_string();
            assert!(message.starts_with("x/hand.toml: "), "{message}");
        }
    }
    assert_eq!((numbers(SMALL).len(), numbers(SMALL_SETTINGS).len()), (50, 13));
}

#[test]
fn shapes_without_size_are_refused() {
    for (from, to) in [
        ("size=\"0.1 0.1 0.1\"", "size=\"0.1 0 0.1\""),
        ("size=\"0.1 0.1 0.1\"", "size=\"-0.1 -0.1 -0.1\""),
        ("radius=\"0.03\"", "radius=\"0\""),
        ("length=\"0.07\"", "length=\"-0.07\""),
    ] {
        refused(read(&SMALL.replacen(from, to, 1), None), &["x/hand.urdf: link '", "not positive"]);
    }
    refused(read(&SMALL.replacen("0.03", "11", 1), None), &["link 'tip'", "1.1e1", "at most 1e1"]);
    let heavy = SMALL.replacen("mass value=\"0.1\"", "mass value=\"101\"", 1);
    refused(read(&heavy, None), &["link 'tip'", "1.01e2", "at most 1e2"]);
}

/// A binary STL of these corners, three a triangle, whose header promises `stated` triangles.
fn stl(corners: &[[f32; 3]], stated: u32) -> Vec<u8> {
    let mut bytes = vec![0_u8; 80];
    bytes.extend(stated.to_le_bytes());
    for triangle in corners.chunks(3) {
        bytes.extend([0; 12]);
        bytes.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn tetrahedron(size: f32) -> Vec<[f32; 3]> {
    let p = [[0.0, 0.0, 0.0], [size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
    [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].iter().flatten().map(|&i: &usize| p[i]).collect()
}

/// The small hand with a mesh as its tip.
fn meshed(name: &str, scale: &str) -> String {
    SMALL.replacen("<sphere radius=\"0.03\"/>", &format!("<mesh filename=\"{name}\" scale=\"{scale}\"/>"), 1)
}

fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (path, content) in entries {
        zip.start_file(*path, SimpleFileOptions::default()).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn read_archive(bytes: &[u8], limits: Limits) -> Result<Loaded, ModelError> {
    let files = Files::archive(Path::new("h.zip"), bytes, &limits)?;
    read::from_files(files, None, &LoadOptions { limits, ..LoadOptions::default() })
}

fn read_meshed(mesh: &[u8], limits: Limits) -> Result<Loaded, ModelError> {
    let urdf = meshed("m/tip.stl", "1 1 1");
    read_archive(&archive(&[("hand.urdf", urdf.as_bytes()), ("m/tip.stl", mesh)]), limits)
}

#[test]
fn meshes_are_counted_before_they_are_believed() {
    let default = Limits::default;
    let good = stl(&tetrahedron(0.05), 4);
    read_meshed(&good, default()).unwrap();
    let file = "h.zip/m/tip.stl";
    refused(
        read_meshed(&stl(&tetrahedron(0.05), u32::MAX), default()),
        &[file, "promises 4294967295 triangles"],
    );
    refused(read_meshed(&stl(&[], u32::MAX), default()), &[file, "0 bytes follow"]);
    refused(read_meshed(&good[..good.len() - 7], default()), &[file, "promises 4 triangles"]);
    refused(read_meshed(&good[..40], default()), &[file, "40 bytes are no STL"]);
    refused(read_meshed(b"solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0", default()), &[file, "STL"]);
    refused(read_meshed(&stl(&tetrahedron(f32::NAN), 4), default()), &[file, "link 'tip'", "corner at"]);
    refused(read_meshed(&stl(&tetrahedron(f32::MAX), 4), default()), &[file, "within 10 m", "0.001"]);
    refused(read_meshed(&stl(&tetrahedron(0.0), 4), default()), &["link 'tip'", "spans no volume"]);
    refused(read_meshed(&stl(&tetrahedron(1e-30), 4), default()), &["link 'tip'", "spans no volume"]);
    let few = Limits { mesh_vertices: 11, ..default() };
    refused(read_meshed(&good, few), &[file, "link 'tip': 12 vertices; the limit is 11"]);
    let few = Limits { mesh_total_vertices: 3, ..default() };
    refused(read_meshed(&good, few), &["4 mesh vertices up to here; the limit is 3"]);
    let few = Limits { mesh_hull_points: 3, ..default() };
    refused(read_meshed(&good, few), &["4 points of mesh hulls up to here; the limit is 3"]);
    let short = Limits { mesh_bytes: 100, ..default() };
    refused(read_meshed(&good, short), &[file, "link 'tip'", "284 bytes; the limit is 100"]);
    let short = Limits { mesh_total_bytes: 0, ..default() };
    refused(read_meshed(&good, short), &["MB of mesh files up to here; the limit is 0"]);
    let none = Limits { meshes: 0, ..default() };
    refused(read_meshed(&good, none), &["link 'tip': 1 mesh files up to here; the limit is 0"]);
    for scale in ["0 0 0", "nan 1 1", "1e300 1 1"] {
        let urdf = meshed("m/tip.stl", scale);
        let bytes = archive(&[("hand.urdf", urdf.as_bytes()), ("m/tip.stl", &good)]);
        refused(read_archive(&bytes, default()), &["link 'tip'"]);
    }
}

#[test]
fn a_description_is_a_few_lines() {
    let described =
        |bytes: usize| read(SMALL, Some(&format!("description = '{}'\n{SMALL_SETTINGS}", "a".repeat(bytes))));
    assert_eq!(described(4096).unwrap().hand.description.len(), 4096);
    refused(described(4097), &["description: 4097 bytes; the limit is 4096"]);
}

#[test]
fn archives_are_read_with_care() {
    let default = Limits::default;
    let small: (&str, &[u8]) = ("hand.urdf", SMALL.as_bytes());
    let settings: (&str, &[u8]) = ("hand.toml", SMALL_SETTINGS.as_bytes());
    let loaded = read_archive(&archive(&[small, settings, ("LICENSE", b"mine")]), default()).unwrap();
    assert_eq!(loaded.hand.tendons[0].force_limit, 2.5, "the archive's settings were used");

    let zeros = vec![0_u8; 40 << 20];
    let bomb = archive(&[small, ("big.stl", &zeros)]);
    assert!(bomb.len() < 100_000, "it is a bomb");
    refused(
        read_archive(&bomb, default()),
        &["h.zip: entry 'big.stl'", "times its packed size; the limit is 100"],
    );
    let tight = Limits { archive_unpacked_bytes: 3000, ..default() };
    refused(
        read_archive(&archive(&[small, ("b.stl", &zeros[..2000])]), tight),
        &["bytes unpacked; the limit is 3000"],
    );
    let few = Limits { archive_entries: 1, ..default() };
    refused(read_archive(&archive(&[small, settings]), few), &["h.zip: archive: 2 entries; the limit is 1"]);
    let short = Limits { archive_bytes: 50, ..default() };
    refused(read_archive(&archive(&[small]), short), &["h.zip: archive", "bytes; the limit is 50"]);

    for name in ["../hand.urdf", "/etc/hand.urdf", "a/../../hand.urdf", "..\\hand.urdf"] {
        refused(
            read_archive(&archive(&[(name, b"")]), default()),
            &["h.zip: entry", "leads out of the archive"],
        );
    }
    let mut zip = zip::ZipWriter::new(Cursor::new(archive(&[])));
    zip.add_symlink("hand.urdf", "/etc/passwd", SimpleFileOptions::default()).unwrap();
    let link = zip.finish().unwrap().into_inner();
    refused(read_archive(&link, default()), &["entry 'hand.urdf'", "symbolic link"]);
    refused(read_archive(&archive(&[settings]), default()), &["h.zip: URDF: there are 0"]);
    refused(
        read_archive(&archive(&[("a.urdf", b""), ("b.urdf", b"")]), default()),
        &["there are 2", "a.urdf, b.urdf"],
    );
    refused(read_archive(b"not an archive", default()), &["h.zip: not valid ZIP"]);
    let whole = archive(&[small]);
    assert!(read_archive(&whole[..whole.len() / 2], default()).is_err());
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("mine");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(outer.path().join("secret.stl"), stl(&tetrahedron(0.05), 4)).unwrap();
    std::fs::write(folder.join("hand.urdf"), meshed("tip.stl", "1 1 1")).unwrap();
    let load = |path: &Path| read::hand(path, &LoadOptions::default());
    std::os::unix::fs::symlink("../secret.stl", folder.join("tip.stl")).unwrap();
    refused(load(&folder), &["mine/tip.stl: link 'tip'", "lies outside the folder"]);
    // Within the folder a link is allowed like a file.
    std::fs::remove_file(folder.join("tip.stl")).unwrap();
    std::fs::rename(outer.path().join("secret.stl"), folder.join("real.stl")).unwrap();
    std::os::unix::fs::symlink("real.stl", folder.join("tip.stl")).unwrap();
    load(&folder).unwrap();
    std::fs::remove_file(folder.join("tip.stl")).unwrap();
    std::fs::create_dir(folder.join("tip.stl")).unwrap();
    refused(load(&folder), &["tip.stl", "not a plain file"]);
    refused(load(&PathBuf::from("/dev/zero")), &["/dev/zero", "not a plain file"]);
}

/// Random changes to good files: the result is an answer and never a panic.
mod mutations {
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    /// One mutation at a position with a piece of text.
    #[derive(Clone, Debug)]
    struct Mutation {
        kind: u8,
        at: usize,
        other: usize,
        length: usize,
    }

    const TOKENS: [&str; 24] = [
        "0",
        "-1",
        "nan",
        "1e308",
        "1e-308",
        "-inf",
        "99999999999999999999",
        "\"",
        "<",
        ">",
        "/>",
        "&",
        "<link>",
        "</link>",
        "<joint",
        "fixed",
        "continuous",
        "prismatic",
        "planar",
        "<mimic joint=\"index_inner\"/>",
        "<mesh filename=\"a.stl\"/>",
        "palm",
        "é",
        "\u{0}",
    ];

    fn mutation() -> impl Strategy<Value = Mutation> {
        (0_u8..6, any::<usize>(), any::<usize>(), 1_usize..200)
            .prop_map(|(kind, at, other, length)| Mutation { kind, at, other, length })
    }

    fn boundary(text: &str, at: usize) -> usize {
        (0..=at % (text.len() + 1)).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
    }

    fn apply(text: &mut String, m: &Mutation) {
        let from = boundary(text, m.at);
        let to = boundary(text, (from + m.length).min(text.len()));
        let found = numbers(text);
        match m.kind {
            0 => text.replace_range(from..to.max(from), ""),
            1 => text.insert_str(from, TOKENS[m.other % TOKENS.len()]),
            2 if !found.is_empty() => {
                let (a, b) = found[m.at % found.len()];
                text.replace_range(a..b, TOKENS[m.other % 7]);
            }
            3 if !found.is_empty() => {
                // One number in the place of another.
                let ((a, b), (c, d)) = (found[m.at % found.len()], found[m.other % found.len()]);
                let number = text[c..d].to_owned();
                text.replace_range(a..b, &number);
            }
            4 => {
                // A line twice.
                let line = text[..from].lines().last().unwrap_or_default().to_owned();
                text.insert_str(from, &line);
            }
            _ => {
                // A piece moved elsewhere.
                let piece = text[from..to.max(from)].to_owned();
                text.replace_range(from..to.max(from), "");
                let at = boundary(text, m.other);
                text.insert_str(at, &piece);
            }
        }
    }

    fn config(cases: u32) -> ProptestConfig {
        ProptestConfig {
            cases,
            failure_persistence: None,
            rng_seed: RngSeed::Fixed(2016),
            ..Default::default()
        }
    }

    proptest! {
        #![proptest_config(config(150))]

        #[test]
        fn of_the_softhand(changes in prop::collection::vec(mutation(), 1..6), in_settings in any::<bool>()) {
            let (mut urdf, mut settings) = (URDF.to_owned(), SETTINGS.to_owned());
            for change in &changes {
                apply(if in_settings { &mut settings } else { &mut urdf }, change);
            }
            if let Ok(loaded) = read(&urdf, Some(&settings)) {
                prop_assert!(loaded.hand.validate().is_ok());
            }
        }
    }

    proptest! {
        #![proptest_config(config(300))]

        #[test]
        fn of_archives_and_meshes(
            bytes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..12),
            cut in prop::option::of(any::<usize>()),
            in_mesh in any::<bool>(),
        ) {
            let mut mesh = stl(&tetrahedron(0.05), 4);
            let spoil = |data: &mut Vec<u8>| {
                for &(at, byte) in &bytes {
                    let n = data.len();
                    data[at % n] = byte;
                }
                if let Some(cut) = cut {
                    data.truncate(cut % (data.len() + 1));
                }
            };
            if in_mesh {
                spoil(&mut mesh);
            }
            let urdf = meshed("tip.stl", "1 1 1");
            let mut whole = archive(&[("hand.urdf", urdf.as_bytes()), ("tip.stl", &mesh)]);
            if !in_mesh {
                spoil(&mut whole);
            }
            if let Ok(loaded) = read_archive(&whole, Limits::default()) {
                prop_assert!(loaded.hand.validate().is_ok());
            }
        }
    }
}

/// The guide states the actual limits.
#[test]
fn the_guide_lists_the_limits() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/hands.md");
    let guide = std::fs::read_to_string(guide).unwrap();
    let section = guide.split("\n## Limits\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let l = Limits::default();
    let rows = [
        ("of `hand.toml`", format!("{}", l.text_bytes)),
        ("of `description`", format!("{}", l.description_bytes)),
        ("one XML tag", format!("{}", l.tag_bytes)),
        ("XML nodes", format!("{}", l.xml_nodes)),
        ("nested XML", format!("{}", l.xml_depth)),
        ("links, joints", format!("{}, {}", l.links, l.joints)),
        ("one chain", format!("{}", l.depth)),
        ("collision shapes", format!("{}, {}", l.link_shapes, l.shapes)),
        ("taxels", format!("{}, {}", l.tendons, l.taxels)),
        ("mesh files", format!("{}", l.meshes)),
        ("bytes of a mesh", format!("{}, {}", l.mesh_bytes, l.mesh_total_bytes)),
        ("vertices of a mesh", format!("{}, {}", l.mesh_vertices, l.mesh_total_vertices)),
        ("on their hulls", format!("{}", l.mesh_hull_points)),
        ("entries in it", format!("{}, {}", l.archive_bytes, l.archive_entries)),
        ("archive unpacked", format!("{}", l.archive_unpacked_bytes)),
        ("packed size", format!("{}", l.archive_ratio)),
        ("distances", format!("{} m", l.length_m)),
        ("mass of a link", format!("{} kg", l.mass_kg)),
        ("other number", format!("{:e}", l.number)),
    ];
    for (what, value) in rows {
        let row = section.lines().find(|line| line.starts_with('|') && line.contains(what)).expect(what);
        assert!(row.ends_with(&format!("| {value} |")), "{row} should end with {value}");
    }
}
