//! Each error names the file that states the number, and each cause has a message of its own.

use std::path::Path;

use crate::read::{self, LoadOptions};

use super::hostile_hands::{SETTINGS, URDF};

#[track_caller]
fn fails(urdf: &str, settings: &str, expected: &str) {
    let files = ((Path::new("x/hand.urdf"), urdf), Some((Path::new("x/hand.toml"), settings)));
    let error = read::from_text(files.0, files.1, None, &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(expected), "{expected}\nis not in\n{error}");
}

#[test]
fn a_number_of_the_urdf_is_blamed_on_the_urdf() {
    let stiff = URDF.replace("<mechanicalElasticity>0.5<", "<mechanicalElasticity>-0.5<");
    fails(
        &stiff,
        SETTINGS,
        "x/hand.urdf: transmission 'close', joint 'bend': <mechanicalElasticity> is the negative stiffness -0.5",
    );
    let slack = URDF.replace("<mechanicalReduction>1<", "<mechanicalReduction>0<");
    fails(&slack, SETTINGS, "x/hand.urdf: transmission 'close': every <mechanicalReduction> is 0");
    let endless = URDF.replace("<mechanicalReduction>1<", "<mechanicalReduction>inf<");
    fails(
        &endless,
        SETTINGS,
        "x/hand.urdf: transmission 'close', joint 'bend': <mechanicalReduction> is 'inf'",
    );
}

#[test]
fn a_number_of_the_settings_is_blamed_on_the_settings() {
    for (from, to, expected) in [
        (
            "force_limit = 2.0",
            "force_limit = 0.0",
            "[tendons.close]: has force_limit 0; valid: force_limit of more than 0",
        ),
        ("force_limit = 2.0", "", "missing field `force_limit`"),
        (
            "force_limit = 2.0",
            "force_limit = nan",
            "[tendons.close]: has force_limit NaN; valid: finite numbers",
        ),
        (
            "force_limit = 2.0",
            "force_limit = inf",
            "[tendons.close]: has force_limit inf; valid: finite numbers",
        ),
        (
            "stiffness = 300.0",
            "stiffness = -300.0",
            "[tendons.close]: has stiffness -300; valid: stiffness of more than 0",
        ),
        (
            "damping = 0.1",
            "damping = -0.1",
            "[tendons.close]: has damping -0.1; valid: damping of at least 0",
        ),
        ("damping = 0.03", "damping = -0.03", "[coordinates.bend]: has damping -0.03"),
        ("friction = 0.9", "friction = -0.9", "settings: has friction -0.9; valid: friction of at least 0"),
        ("speed_limit = 2.0", "speed_limit = 0.0", "[motors.pull]: has speed_limit 0"),
        ("scaling = 1.0", "scaling = 0.0", "[motors.pull]: has scaling 0; valid: scaling other than 0"),
    ] {
        assert!(SETTINGS.contains(from), "{from}");
        let settings = SETTINGS.replace(from, to);
        fails(URDF, &settings, expected);
        fails(URDF, &settings, "x/hand.toml: ");
    }
}
