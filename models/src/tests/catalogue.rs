//! The catalogue's data, and its loader's errors about wrong data.

use crate::Vec3;
use crate::catalogue::Catalogue;

const HEAD: &str = "source = \"x\"\n[[object]]\nid = \"a\"\nname = \"A\"\ncategory = \"food\"\nmass = 0.2\n\
    friction = 0.5\ncolor = [0.1, 0.2, 0.3]\n";

fn refusal(text: &str) -> String {
    Catalogue::parse("x.toml", text).expect_err("it is wrong").to_string()
}

#[test]
fn there_are_at_least_forty_objects_and_all_are_sane() {
    let items = Catalogue::builtin().items();
    assert!(items.len() >= 40, "{}", items.len());
    for item in items {
        let (object, name) = (&item.object, &item.object.name);
        assert!((0.001..3.0).contains(&object.mass), "{name}: {} kg", object.mass);
        assert!(item.size.iter().all(|x| (0.004..0.5).contains(x)), "{name}: {:?} m", item.size);
        assert!((0.1..1.5).contains(&object.friction), "{name}");
        assert!(item.title.len() > 2 && item.category.len() > 2, "{name}");
        assert!(["calli2015", "apc2015"].contains(&item.source.as_str()), "{name}");
    }
}

#[test]
fn frames_lie_in_the_middle_of_the_bounds() {
    for item in Catalogue::builtin().items() {
        let (low, high) = item.object.bounds();
        let middle = (low + high) * 0.5;
        assert!(middle.length() < 2e-3, "{}: {middle}", item.object.name);
    }
}

/// A solid within given bounds has no larger principal moments than its mass at the bounds' corners, and obeys the
/// triangle inequality.
#[test]
fn inertias_are_those_of_solids_within_the_bounds() {
    for item in Catalogue::builtin().items() {
        let (object, name) = (&item.object, &item.object.name);
        let [x, y, z] = item.size.map(|x| 0.25 * x * x);
        let most = Vec3::new(y + z, x + z, x + y) * object.mass;
        let about = object.inertia;
        let diagonal = Vec3::new(about.col(0).x, about.col(1).y, about.col(2).z);
        for (k, (have, most)) in diagonal.to_array().into_iter().zip(most.to_array()).enumerate() {
            assert!(have > 0.0 && have < most, "{name}: axis {k}: {have} of at most {most} kg·m²");
        }
        let [a, b, c] = diagonal.to_array();
        assert!(a + b > c && b + c > a && a + c > b, "{name}: {diagonal}");
        assert!(about.determinant() > 0.0, "{name}");
        let (low, high) = object.bounds();
        assert!(object.com.cmpge(low).all() && object.com.cmple(high).all(), "{name}: {}", object.com);
    }
}

#[test]
fn closed_forms() {
    let catalogue = Catalogue::builtin();
    let box_ = &catalogue.get("003_cracker_box").expect("it is there").object;
    let (m, y, z) = (box_.mass, 0.158, 0.21);
    assert!((box_.inertia.col(0).x - m * (y * y + z * z) / 12.0).abs() < 1e-12);
    let can = &catalogue.get("005_tomato_soup_can").expect("it is there").object;
    assert!((can.inertia.col(2).z - 0.5 * can.mass * 0.033 * 0.033).abs() < 1e-12);
    let ball = &catalogue.get("056_tennis_ball").expect("it is there").object;
    let r: f64 = 0.0323;
    assert!((ball.inertia.col(1).y - 0.4 * ball.mass * r * r).abs() < 1e-9);
}

#[test]
fn a_vessel_is_hollow_and_closed_around() {
    let mug = &Catalogue::builtin().get("025_mug").expect("it is there").object;
    let inside = |p: Vec3| {
        mug.parts.iter().any(|(pose, shape)| {
            let (shape, upright) = shape.to_parry().expect("solid");
            shape.contains_point(&(*pose * upright), p)
        })
    };
    assert!(!inside(Vec3::new(-0.01, 0.0, 0.0)), "there is room for coffee");
    let (_, high) = mug.bounds();
    let middle_x = high.x - 0.5 * Catalogue::builtin().get("025_mug").expect("it is there").size[0];
    assert!(middle_x.abs() < 2e-3);
    // The wall of radius 0.04 is around the bottom's centre.
    let (bottom, _) = &mug.parts[0];
    for k in 0..360 {
        let (s, c) = libm::sincos(f64::from(k).to_radians());
        let hit = (360..=420).any(|r| {
            let r = f64::from(r) * 1e-4;
            inside(Vec3::new(bottom.translation.x + r * c, r * s, 0.02))
        });
        assert!(hit, "a gap at {k}°");
    }
}

#[test]
fn wrong_data_is_named() {
    let with = |parts: &str| format!("{HEAD}parts = [{parts}]\n");
    assert!(Catalogue::parse("x.toml", &with("{ shape = \"sphere\", radius = 0.02 }")).is_ok());
    let cases = [
        (with("{ shape = \"sphere\", radius = -0.02 }"), "part 0"),
        (with("{ shape = \"sphere\", radius = nan }"), "part 0"),
        (with("{ shape = \"cone\", radius = 0.02 }"), "cone"),
        (with("{ shape = \"sphere\", radius = 0.02, colour = 1 }"), "colour"),
        (with("{ shape = \"sphere\", radius = 0.02, at = [inf, 0.0, 0.0] }"), "place"),
        (with(""), "parts"),
        (with("{ shape = \"box\", size = [2.0, 0.1, 0.1] }"), "at most 1 m"),
        (
            with("{ shape = \"capsule\", radius = 0.02, ends = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]] }"),
            "a sphere has no ends",
        ),
        (
            with("{ shape = \"wall\", sides = 2, bottom = 0.1, top = 0.1, height = 0.1, thickness = 0.01 }"),
            "3 to 64",
        ),
        (
            with("{ shape = \"wall\", sides = 9, bottom = 0.1, top = 0.1, height = 0.1, thickness = 0.2 }"),
            "thickness",
        ),
        (
            HEAD.replace("mass = 0.2", "mass = 1e9") + "parts = [{ shape = \"sphere\", radius = 0.02 }]",
            "at most 20 kg",
        ),
        (
            HEAD.replace("mass = 0.2", "mass = 0.0") + "parts = [{ shape = \"sphere\", radius = 0.02 }]",
            "mass",
        ),
        (HEAD.replace("0.3]", "3.0]") + "parts = [{ shape = \"sphere\", radius = 0.02 }]", "0 to 1"),
    ];
    for (text, expected) in cases {
        let error = refusal(&text);
        assert!(error.contains(expected), "{error} should name {expected}");
    }
    let one = with("{ shape = \"sphere\", radius = 0.02 }");
    let twice = format!("{one}{}", one.replace("source = \"x\"\n", ""));
    assert!(refusal(&twice).contains("object 'a': stands here twice"));
}

#[test]
fn a_name_that_is_not_there_gets_near_ones() {
    let error = Catalogue::builtin().find("cracker_box").expect_err("it has a number");
    assert!(error.contains("003_cracker_box"), "{error}");
}
