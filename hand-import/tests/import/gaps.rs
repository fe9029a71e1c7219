//! Descriptions with a gap or a number that no hand can have: what the import makes of them, `hand check` accepts.

use palmares_models::measure::HandLimits;
use palmares_models::read::Loaded;

use super::*;

/// The written hand, with all figures within the limits of `hand check`.
#[track_caller]
fn within_limits(imported: &Imported) -> Hand {
    let out = tempfile::tempdir().expect("a folder");
    imported.write(out.path(), true).expect("written");
    let Loaded { hand, sources, .. } =
        hand(out.path(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let excesses = HandLimits::default().excesses(&hand.figures(), &sources);
    let excesses: Vec<String> = excesses.iter().map(ToString::to_string).collect();
    assert!(excesses.is_empty(), "{}", excesses.join("\n"));
    hand
}

#[test]
fn dry_friction_above_the_motor_is_a_stand_in() {
    for (friction, sticks) in [("100", true), ("0.7", true), ("0.3", false)] {
        let text =
            finger("").replace("<dynamics damping='0.01'/>", &format!("<dynamics friction='{friction}'/>"));
        let imported = Source::new(&[("hand.urdf", &text)]).import("hand.urdf");
        let hand = within_limits(&imported);
        let left = if sticks { 0.0 } else { 0.3 };
        hand.coordinates.iter().for_each(|c| near(c.friction, left));
        let said = imported.decisions.iter().filter(|decision| decision.text.contains("it would never move"));
        assert_eq!(said.count(), if sticks { 2 } else { 0 }, "{friction}");
    }
}

#[test]
fn a_servos_speed_counts_the_range_that_followers_leave() {
    let mimic = "<mimic joint='base' multiplier='2'/>";
    let whole = finger("");
    let (before, after) = whole.split_at(whole.rfind("<limit").expect("a limit"));
    let narrow = after
        .replace("lower='-0.2' upper='1.4'", "lower='-0.1' upper='0.1'")
        .replace("<dynamics", &format!("{mimic}<dynamics"));
    let imported = Source::new(&[("hand.urdf", &format!("{before}{narrow}"))]).import("hand.urdf");
    no_problems(&imported);
    let hand = within_limits(&imported);
    let [c] = hand.coordinates.as_slice() else { panic!("{:?}", hand.coordinates) };
    assert_eq!([c.lower, c.upper], [-0.05, 0.05]);
}

#[test]
fn links_without_touching_shapes_keep_their_joints() {
    let drawn = finger("").replace("collision>", "visual>");
    let far = finger("")
        .replace("<box size='0.02 0.02 0.04'/>", "<mesh filename='package://elsewhere/finger.stl'/>");
    let bare = finger("");
    let bare = bare.split("<collision>").enumerate().fold(String::new(), |out, (k, part)| {
        out + if k == 0 { part } else { part.split_once("</collision>").expect("ends").1 }
    });
    for text in [drawn, far, bare] {
        let imported = Source::new(&[("hand.urdf", &text)]).import("hand.urdf");
        assert_eq!(loaded(&imported).coordinates.len(), 2, "{text}");
    }
    // A file that Git LFS keeps elsewhere.
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n";
    let text = finger("").replace("<box size='0.02 0.02 0.04'/>", "<mesh filename='finger.stl'/>");
    let imported = Source::new(&[("hand.urdf", &text), ("finger.stl", pointer)]).import("hand.urdf");
    assert_eq!(loaded(&imported).coordinates.len(), 2);
    assert!(imported.problems().any(|problem| problem.text.contains("LFS")), "{:?}", imported.decisions);
}

#[test]
fn the_stand_in_of_a_motor_is_still_none() {
    let wire = "<link name='wire'><inertial><mass value='0.1'/><inertia ixx='1e-3' iyy='1e-3' izz='1e-3' ixy='0' ixz='0' iyz='0'/>\
                </inertial></link><joint name='synergy' type='revolute'><parent link='palm'/><child link='wire'/><axis xyz='0 0 1'/>\
                <limit lower='0' upper='1' effort='100' velocity='10'/></joint>";
    let imported = Source::new(&[("hand.urdf", &finger(wire))]).import("hand.urdf");
    has(&imported, DecisionKind::Dropped, "joint 'synergy'", "moves no shape");
    assert_eq!(loaded(&imported).coordinates.len(), 2);
}

#[test]
fn one_link_without_inertia_replaces_only_its_own() {
    let whole = finger("");
    let own = |text: &str| {
        let hand = loaded(&Source::new(&[("hand.urdf", text)]).import("hand.urdf"));
        hand.links.iter().map(|link| (link.name.clone(), link.inertia)).collect::<Vec<_>>()
    };
    let stated = "<inertial><mass value='0.05'/><origin xyz='0 0 0.02'/>";
    let odd = whole.replacen(stated, "<inertial><mass value='0.05'/><origin xyz='0 0.004 0.012'/>", 2);
    let at = odd.rfind("<inertial>").expect("one");
    let end = odd.rfind("</inertial>").expect("one") + "</inertial>".len();
    for gap in ["", "<inertial><mass value='0.05'/></inertial>"] {
        let text = format!("{}{gap}{}", &odd[..at], &odd[end..]);
        let found = own(&text);
        for (name, inertia) in found.iter().filter(|(name, _)| name != "distal") {
            near(inertia.com.y, 0.004);
            near(inertia.com.z, 0.012);
            near(inertia.about_com.x_axis.x, 1e-5);
            assert!(name == "palm" || name == "proximal");
        }
        let (_, tip) = found.iter().find(|(name, _)| name == "distal").expect("there");
        near(tip.com.z, 0.02);
        assert!(tip.mass > 0.0);
    }
}

#[test]
fn a_missing_sdf_model_is_one_line() {
    let hand = "<sdf version='1.6'><model name='whole'><include><uri>model://other</uri></include>\
                <link name='palm'><inertial><mass>0.2</mass></inertial><collision name='c'><geometry><box><size>0.05 0.05 0.02</size></box>\
                </geometry></collision></link><link name='finger'><pose>0 0 0.02 0 0 0</pose><inertial><mass>0.05</mass></inertial>\
                <collision name='c'><pose>0 0 0.03 0 0 0</pose><geometry><sphere><radius>0.01</radius></sphere></geometry></collision></link>\
                <joint name='j' type='revolute'><parent>palm</parent><child>finger</child><axis><xyz>1 0 0</xyz>\
                <limit><lower>0</lower><upper>1</upper></limit></axis></joint></model></sdf>";
    let config = "<model><name>hand</name><sdf version='1.6'>hand.sdf</sdf></model>";
    let source = Source::new(&[
        ("hand/hand.sdf", hand),
        ("hand/model.config", config),
        ("beside/model.config", config),
    ]);
    let imported = source.import("hand/hand.sdf");
    let problems: Vec<String> = imported.problems().map(ToString::to_string).collect();
    let [problem] = problems.as_slice() else { panic!("{}", problems.join("\n")) };
    assert!(
        problem.contains("'model://other' is not in") && problem.contains("name the folder that holds it"),
        "{problem}"
    );
}
