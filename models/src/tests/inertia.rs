//! Closed forms of mass properties against textbook values and against each other.

use core::f64::consts::PI;

use crate::hand::Inertia;
use crate::object::Object;
use crate::read::hollow::MeshOf;
use crate::read::report::Report;
use crate::read::urdf::link::LinkReader;
use crate::read::{InertiaPolicy, LoadOptions};
use crate::shape::Shape;
use crate::shape::inertia::of_shapes;
use crate::{Mat3, Pose, Rotation, Vec3};

fn one(shape: &Shape, mass: f64) -> Inertia {
    of_shapes([(Pose::IDENTITY, shape)], mass).unwrap()
}

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs(), "{a} is not {b}");
}

#[test]
fn ball_box_cylinder_and_capsule_are_textbook() {
    let ball = one(&Shape::Sphere { radius: 0.3 }, 2.0);
    close(ball.about_com.x_axis.x, 0.4 * 2.0 * 0.09, 1e-14);

    let cuboid = one(&Shape::Box { half_extents: [0.1, 0.2, 0.3], rounding: 0.0 }, 3.0);
    close(cuboid.about_com.x_axis.x, 3.0 / 3.0 * (0.04 + 0.09), 1e-14);
    close(cuboid.about_com.z_axis.z, 3.0 / 3.0 * (0.01 + 0.04), 1e-14);

    let cylinder = one(&Shape::Cylinder { radius: 0.1, half_length: 0.2 }, 5.0);
    close(cylinder.about_com.z_axis.z, 0.5 * 5.0 * 0.01, 1e-14);
    close(cylinder.about_com.x_axis.x, 5.0 / 12.0 * (3.0 * 0.01 + 0.16), 1e-14);

    // Cylinder plus two half balls, each with its centre of mass 3r/8 beyond the cylinder's end.
    let (r, l) = (0.1, 0.2);
    let capsule = one(&Shape::Capsule { radius: r, half_length: l }, 1.0);
    let (v_cylinder, v_ball) = (PI * r * r * 2.0 * l, 4.0 / 3.0 * PI * r * r * r);
    let density = 1.0 / (v_cylinder + v_ball);
    let (m_cylinder, m_ball) = (density * v_cylinder, density * v_ball);
    let along = m_cylinder * r * r / 2.0 + 0.4 * m_ball * r * r;
    let across = m_cylinder * (r * r / 4.0 + l * l / 3.0) + m_ball * (0.4 * r * r + l * l + 0.75 * l * r);
    close(capsule.about_com.z_axis.z, along, 1e-13);
    close(capsule.about_com.x_axis.x, across, 1e-13);
}

#[test]
fn a_hull_agrees_with_the_box_it_is() {
    let corner = |i: usize, axis: usize, half: f64| if i >> axis & 1 == 0 { -half } else { half };
    let corners = |h: [f64; 3]| (0..8).map(|i| [0, 1, 2].map(|a| corner(i, a, h[a]))).collect::<Vec<_>>();
    let sharp = one(&Shape::Hull { points: corners([0.1, 0.2, 0.3]), rounding: 0.0 }, 1.0);
    let cuboid = one(&Shape::Box { half_extents: [0.1, 0.2, 0.3], rounding: 0.0 }, 1.0);
    assert!((sharp.about_com - cuboid.about_com).to_cols_array().iter().all(|x| x.abs() < 1e-14));

    let rounded = one(&Shape::Hull { points: corners([0.05, 0.15, 0.25]), rounding: 0.05 }, 1.0);
    let round_box = one(&Shape::Box { half_extents: [0.1, 0.2, 0.3], rounding: 0.05 }, 1.0);
    for i in 0..3 {
        close(rounded.principal()[i], round_box.principal()[i], 5e-3);
    }
}

#[test]
fn two_halves_are_the_whole() {
    let whole = Inertia { ..one(&Shape::Box { half_extents: [0.2, 0.1, 0.1], rounding: 0.0 }, 2.0) };
    let half = Shape::Box { half_extents: [0.1, 0.1, 0.1], rounding: 0.0 };
    // At another position, and turned by a quarter about x, under which the half is symmetric.
    let place = |x: f64| {
        let turn = Rotation::from_xyzw(0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt());
        Pose::from_parts(Vec3::new(x, 0.3, 0.4), turn)
    };
    let by_shapes = of_shapes([(place(-0.1), &half), (place(0.1), &half)], 2.0).unwrap();
    let by_bodies = one(&half, 1.0).moved(&place(-0.1)).plus(&one(&half, 1.0).moved(&place(0.1)));
    for sum in [by_shapes, by_bodies] {
        assert!((sum.com - Vec3::new(0.0, 0.3, 0.4)).length() < 1e-14);
        assert!((sum.about_com - whole.about_com).to_cols_array().iter().all(|x| x.abs() < 1e-14));
    }
}

#[test]
fn impossible_inertias_are_named() {
    let body = |d: [f64; 3]| Inertia {
        mass: 1.0,
        com: Vec3::ZERO,
        about_com: Mat3::from_diagonal(Vec3::from_array(d)),
    };
    assert_eq!(body([1.0, 1.0, 1.5]).implausible(), None);
    assert!(body([1.0, 1.0, 2.1]).implausible().unwrap().contains("triangle"));
    assert!(body([-1.0, 1.0, 1.0]).implausible().unwrap().contains("negative"));
    assert!(body([1.0, f64::NAN, 1.0]).implausible().unwrap().contains("finite"));
}

#[test]
fn objects_get_their_inertia_or_say_why_not() {
    let ball = || vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.05 })];
    let object = Object::new("ball", ball(), 1.0, 0.8, 1e-4).unwrap();
    close(object.inertia.y_axis.y, 0.4 * 0.0025, 1e-14);
    assert!(
        Object::new("none", vec![], 1.0, 0.8, 0.0).unwrap_err().to_string().contains("none with a volume")
    );
    assert!(Object::new("light", ball(), 0.0, 0.8, 0.0).unwrap_err().to_string().contains("mass"));
    assert!(Object::new("slippery", ball(), 1.0, -0.1, 0.0).unwrap_err().to_string().contains("friction"));
    let flat = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.0 })];
    assert!(Object::new("flat", flat, 1.0, 0.8, 0.0).unwrap_err().to_string().contains("part 0"));
}

/// Recomputes every `<inertial>`; where one is wrong, the message is the lines to write instead.
pub(super) fn assert_stated(urdf: &str, settings: &str) {
    let settings = toml::from_str(settings).unwrap();
    let mut report = Report::new("hand.urdf".as_ref());
    let mut body = |inertia: InertiaPolicy, link: &urdf_rs::Link| {
        let options = LoadOptions { inertia, ..LoadOptions::default() };
        LinkReader::new(&settings, &options, None, MeshOf::Hand).read(link, &mut report).unwrap().inertia
    };
    let mut wrong = String::new();
    for link in &urdf_rs::read_from_string(urdf).unwrap().links {
        let stated = body(InertiaPolicy::FromFile, link);
        let derived = body(InertiaPolicy::FromGeometry, link);
        let difference = (stated.about_com - derived.about_com).to_cols_array();
        let size = derived.principal()[2];
        let far = (stated.com - derived.com).length() > 1e-6;
        if far || difference.iter().any(|x| x.abs() > 1e-4 * size) {
            let (c, i) = (derived.com, derived.about_com);
            wrong += &format!(
                "{}|{:.6} {:.6} {:.6}|ixx=\"{:.5e}\" ixy=\"{:.5e}\" ixz=\"{:.5e}\" iyy=\"{:.5e}\" iyz=\"{:.5e}\" izz=\"{:.5e}\"\n",
                link.name,
                c.x,
                c.y,
                c.z,
                i.x_axis.x,
                i.x_axis.y,
                i.x_axis.z,
                i.y_axis.y,
                i.y_axis.z,
                i.z_axis.z,
            );
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
}
