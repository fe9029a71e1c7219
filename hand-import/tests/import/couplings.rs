//! Joints that are bound to each other: by a tendon's narrow range, by an equality of tendons, by a curve.

use super::*;

/// A hand of one finger of three joints beside a thumb; `tail` are its tendons, equalities and actuators.
fn fingers(tail: &str) -> Source {
    let body = |name: &str, at: &str, joint: &str, inside: &str| {
        format!(
            "<body name='{name}' pos='{at}'><joint name='{joint}'/><geom type='capsule' size='0.006' \
             fromto='0 0 0.008 0 0 0.03' mass='0.02'/>{inside}</body>"
        )
    };
    let finger = body("c", "0 0 0.038", "distal", "");
    let finger = body("a", "0.02 0 0.02", "proximal", &body("b", "0 0 0.038", "middle", &finger));
    let thumb = body("t", "-0.02 0 0.02", "thumb", "");
    Source::new(&[(
        "hand.xml",
        &format!(
            "<mujoco model='bound'><compiler angle='radian' autolimits='true'/>\
             <default><joint axis='0 1 0' range='0 1.2' damping='0.02'/></default><worldbody><body name='palm'>\
             <geom type='box' size='0.03 0.05 0.015' mass='0.3'/>{finger}{thumb}</body></worldbody>{tail}</mujoco>"
        ),
    )])
}

/// A servo of a joint.
fn servo(joint: &str) -> String {
    format!("<position name='m_{joint}' joint='{joint}' kp='2' ctrlrange='0 1.2' forcerange='-1 1'/>")
}

/// Ratio and offset by which the joint above a link follows its coordinate, and that coordinate's name.
fn law<'a>(hand: &'a Hand, link: &str) -> (&'a str, f64, f64) {
    let joint = hand.links[hand.link(link).expect("a link")].joint.as_ref().expect("a joint");
    (&hand.coordinates[joint.coordinate].name, joint.hinges[0].ratio, joint.hinges[0].offset)
}

#[test]
fn a_narrow_range_of_two_joints_makes_one_follow_the_other() {
    let tendon = "<tendon><fixed name='rolling' limited='true' range='-0.001 0.001'>\
                  <joint joint='middle' coef='0.007'/><joint joint='distal' coef='-0.008'/></fixed></tendon>";
    // The motor's joint leads, wherever it is in the finger.
    for (driven, link, leader, ratio) in
        [("middle", "c", "middle", 0.875), ("distal", "b", "distal", 8.0 / 7.0)]
    {
        let actuators =
            format!("<actuator>{}{}{}</actuator>", servo("proximal"), servo("thumb"), servo(driven));
        let imported = fingers(&format!("{tendon}{actuators}")).import("hand.xml");
        no_problems(&imported);
        has(&imported, DecisionKind::Guessed, "rolling", "binds its joints, within 0.125");
        let hand = loaded(&imported);
        let (name, found, offset) = law(&hand, link);
        assert_eq!((name, hand.tendons.len(), hand.coordinates.len()), (leader, 3, 3));
        near(found, ratio);
        near(offset, 0.0);
    }
}

#[test]
fn a_wide_range_is_a_limit_and_binds_nothing() {
    let tendon = "<tendon><fixed name='cable' limited='true' range='0 0.012'>\
                  <joint joint='middle' coef='0.007'/><joint joint='distal' coef='0.008'/></fixed></tendon>";
    let actuators =
        format!("<actuator>{}{}{}</actuator>", servo("proximal"), servo("middle"), servo("distal"));
    let imported = fingers(&format!("{tendon}{actuators}")).import("hand.xml");
    has(&imported, DecisionKind::Guessed, "cable", "slack cable");
    assert_eq!(loaded(&imported).coordinates.len(), 4);
}

#[test]
fn a_narrow_range_of_three_joints_is_a_stiff_tendon_both_ways() {
    let tendon = "<tendon><fixed name='row' range='0.0018 0.0022'><joint joint='proximal' coef='0.01'/>\
                  <joint joint='middle' coef='0.005'/><joint joint='distal' coef='-0.02'/></fixed></tendon>";
    let actuators =
        format!("<actuator>{}{}{}</actuator>", servo("proximal"), servo("middle"), servo("thumb"));
    let imported = fingers(&format!("{tendon}{actuators}")).import("hand.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    let tie = hand.tendons.iter().find(|tendon| tendon.name == "row_row").expect("a tie");
    assert!(tie.both_ways && tie.motors.is_empty());
    // 0.01 p + 0.005 m − 0.02 d = 0.002.
    let q: Vec<f64> = hand
        .coordinates
        .iter()
        .map(|c| match c.name.as_str() {
            "proximal" => 0.8,
            "middle" => 0.4,
            "distal" => 0.4,
            _ => 0.0,
        })
        .collect();
    near(tie.length(&q), tie.rest);
}

#[test]
fn a_narrow_range_of_joints_that_other_couplings_bind_is_not_lost() {
    // The middle joint follows one, the last joint another: neither can follow a second one.
    let tail = "<tendon><fixed name='row' range='-0.0001 0.0001'><joint joint='middle' coef='0.01'/>\
                <joint joint='distal' coef='-0.01'/></fixed></tendon><equality><joint joint1='middle' joint2='proximal'/>\
                <joint joint1='distal' joint2='thumb'/></equality>";
    let actuators = format!("<actuator>{}{}</actuator>", servo("proximal"), servo("thumb"));
    let imported = fingers(&format!("{tail}{actuators}")).import("hand.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    let tie = hand.tendons.iter().find(|tendon| tendon.name == "row_row").expect("a tie");
    // Their leaders are tied instead.
    assert_eq!((tie.both_ways, tie.moment_arms.len()), (true, 2));
    near(tie.moment_arms[0].1, -tie.moment_arms[1].1);
}

#[test]
fn an_equality_of_tendons_lets_one_joint_follow_the_others_motor() {
    let tendons = "<tendon><fixed name='left'><joint joint='proximal' coef='0.01'/></fixed>\
                   <fixed name='right'><joint joint='thumb' coef='0.02'/></fixed></tendon>";
    let winch =
        "<actuator><position name='winch' tendon='left' kp='2000' ctrlrange='0 0.012' forcerange='-20 20'/>";
    for (first, second, line) in [("left", "right", "-0.001 2"), ("right", "left", "0.001 0.5")] {
        let equality = format!(
            "<equality><tendon tendon1='{first}' tendon2='{second}' polycoef='{line} 0 0 0'/></equality>"
        );
        let actuators = format!("{winch}{}{}</actuator>", servo("middle"), servo("distal"));
        let imported = fingers(&format!("{tendons}{equality}{actuators}")).import("hand.xml");
        no_problems(&imported);
        let hand = loaded(&imported);
        let (leader, ratio, offset) = law(&hand, "t");
        assert_eq!(leader, "proximal");
        // 0.01 p = −0.001 + 2 · 0.02 t, or 0.02 t = 0.001 + 0.5 · 0.01 p.
        near(ratio, 0.25);
        near(offset, if first == "left" { 0.025 } else { 0.05 });
    }
}

#[test]
fn an_equality_of_tendons_over_several_joints_is_a_stiff_tendon() {
    let tendons = "<tendon><fixed name='left'><joint joint='proximal' coef='0.01'/><joint joint='middle' coef='0.01'/>\
                   </fixed><fixed name='right'><joint joint='thumb' coef='0.01'/></fixed></tendon>\
                   <equality><tendon name='tie' tendon1='left' tendon2='right'/></equality>";
    let winch =
        "<actuator><position name='winch' tendon='left' kp='2000' ctrlrange='0 0.02' forcerange='-20 20'/>";
    let imported = fingers(&format!("{tendons}{winch}{}</actuator>", servo("distal"))).import("hand.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    let tie = hand.tendons.iter().find(|tendon| tendon.name == "tie").expect("a tie");
    let arm = |joint: &str| {
        let found = tie.moment_arms.iter().find(|(c, _)| hand.coordinates[*c].name == joint);
        found.map_or(0.0, |(_, arm)| *arm)
    };
    near(arm("proximal"), arm("middle"));
    near(arm("proximal"), -arm("thumb"));
}

#[test]
fn a_spatial_tendon_in_an_equality_is_a_problem_and_not_silence() {
    let tendons = "<tendon><spatial name='left'><site site='s'/><site site='e'/></spatial>\
                   <fixed name='right'><joint joint='thumb' coef='0.01'/></fixed></tendon>\
                   <equality><tendon tendon1='left' tendon2='right'/></equality>";
    let source = fingers(&format!("{tendons}<actuator>{}</actuator>", servo("proximal")));
    let text = fs::read_to_string(source.path("hand.xml")).expect("text");
    let text = text.replace("<body name='a'", "<site name='s' pos='0 0 0.03'/><body name='a'");
    let text = text.replace("<body name='b'", "<site name='e' pos='0.01 0 0.02'/><body name='b'");
    source.write("hand.xml", text.as_bytes());
    has(&source.import("hand.xml"), DecisionKind::Problem, "tendon", "couples a spatial tendon");
}

#[test]
fn a_curve_between_two_joints_is_kept_as_it_is() {
    let equality = "<equality><joint joint1='distal' joint2='middle' polycoef='0.1 0.3 0.4 0 0'/></equality>";
    let actuators =
        format!("<actuator>{}{}{}</actuator>", servo("proximal"), servo("middle"), servo("thumb"));
    let imported = fingers(&format!("{equality}{actuators}")).import("hand.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "distal", "by the polynomial [0.1, 0.3, 0.4]");
    let hand = loaded(&imported);
    let index = |name: &str| hand.coordinates.iter().position(|c| c.name == name).expect("a joint");
    let (middle, distal) = (index("middle"), index("distal"));
    assert_eq!(
        [hand.coordinates[middle].lower, hand.coordinates[middle].upper],
        [0.0, 1.2],
        "all of its range is left"
    );
    let tie = hand.tendons.iter().find(|tendon| tendon.name == "distal_curve").expect("a tie");
    for x in [0.0, 0.4, 1.2] {
        let mut q = vec![0.0; hand.coordinates.len()];
        (q[middle], q[distal]) = (x, 0.1 + 0.3 * x + 0.4 * x * x);
        near(tie.length(&q), tie.rest);
    }
}

#[test]
fn a_nearly_straight_curve_is_a_line_within_the_followers_limits() {
    let equality = "<equality><joint joint1='distal' joint2='middle' polycoef='0 0.5 0.01 0 0'/></equality>";
    let actuators = format!("<actuator>{}{}</actuator>", servo("proximal"), servo("middle"));
    let imported = fingers(&format!("{equality}{actuators}")).import("hand.xml");
    has(&imported, DecisionKind::Guessed, "distal", "off by at most 0.00");
    let hand = loaded(&imported);
    let (leader, ratio, offset) = law(&hand, "c");
    assert_eq!(leader, "middle");
    assert!(offset >= 0.0 && (ratio - 0.51).abs() < 0.01, "{ratio} and {offset}");
    let middle = hand.coordinates.iter().find(|c| c.name == "middle").expect("a joint");
    assert_eq!([middle.lower, middle.upper], [0.0, 1.2]);
}
