// scratch
use palmares_models::hand::*;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::{Command, Config, Model, State, World};
use std::sync::Arc;
struct R(u64);
impl R {
    fn f(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = self.0 >> 11;
        (x as f64) / (1u64 << 53) as f64
    }
    fn s(&mut self) -> f64 {
        2.0 * self.f() - 1.0
    }
}
fn world(
    c: Config,
    fixed: &[(Shape, Pose, f64)],
    ground: Option<f64>,
    objs: &[(Vec<(Pose, Shape)>, f64, f64, f64, Pose, Vec3, Vec3)],
) -> (World, Command) {
    let mut m = Model::new(c, None).unwrap();
    if let Some(mu) = ground {
        m.add_ground(0.0, mu);
    }
    for (s, p, mu) in fixed {
        m.add_static("f", s, *p, *mu).unwrap();
    }
    for (k, o) in objs.iter().enumerate() {
        let mut ob = Object::new(format!("o{k}"), o.0.clone(), o.1, o.2, 0.0).unwrap();
        ob.restitution = o.3;
        m.add_object(Arc::new(ob)).unwrap();
    }
    let poses: Vec<Pose> = objs.iter().map(|o| o.4).collect();
    let mut st = State::at_rest(&m, Pose::IDENTITY, &poses);
    for (k, o) in objs.iter().enumerate() {
        let at = m.object_dofs(k);
        st.v[at..at + 3].copy_from_slice(&o.5.to_array());
        st.v[at + 3..at + 6].copy_from_slice(&o.6.to_array());
    }
    let w = World::new(Arc::new(m), st);
    let c = Command::stay(w.model(), Pose::IDENTITY);
    (w, c)
}
fn energy(w: &World, k: usize) -> f64 {
    let o = &w.model().objects()[k];
    let (v, om) = w.state().object_velocity(w.model(), k);
    let r = Mat3::from_quat(w.state().objects[k].rotation);
    let own = r.transpose() * om;
    let springs = 0.0;
    springs
        + 0.5 * o.mass * v.length_squared()
        + 0.5 * own.dot(o.inertia * own)
        + o.mass * 9.81 * w.state().objects[k].translation.z
}
fn cfg(h: f64) -> Config {
    Config { sleeping: false, ..Config::with_step(h) }
}
fn bx(a: f64, b: f64, c: f64) -> Shape {
    Shape::Box { half_extents: [a / 2., b / 2., c / 2.], rounding: 0.0 }
}
fn a(h: f64) {
    for (name, shape, m) in [
        ("box", bx(0.06, 0.05, 0.15), 0.3),
        ("cyl", Shape::Cylinder { radius: 0.03, half_length: 0.05 }, 0.3),
        ("caps", Shape::Capsule { radius: 0.02, half_length: 0.04 }, 0.2),
    ] {
        for (e, mu) in [(0.9, 0.5), (0.5, 0.5), (1.0, 0.0), (1.0, 1.0)] {
            let mut r = R(1);
            let (mut n, mut worst, mut wstep) = (0, 0.0f64, 0.0f64);
            for _ in 0..200 {
                let q = Rotation::from_xyzw(r.s(), r.s(), r.s(), r.s()).normalize();
                let (mut w, c) = world(
                    cfg(h),
                    &[],
                    Some(mu),
                    &[(
                        vec![(Pose::IDENTITY, shape.clone())],
                        m,
                        mu,
                        e,
                        Pose::from_parts(Vec3::new(0., 0., 0.1), q),
                        Vec3::new(1.5 * r.s(), 1.5 * r.s(), -2.0),
                        Vec3::new(10. * r.s(), 10. * r.s(), 10. * r.s()),
                    )],
                );
                let mut least = energy(&w, 0);
                let mut gained = 0.0f64;
                let first = least;
                let mut prev = least;
                for _ in 0..(0.2 / h) as usize {
                    w.step(&c);
                    if !w.contact_forces().is_empty() {
                        continue;
                    }
                    let now = energy(&w, 0);
                    gained = gained.max(now / least - 1.0);
                    wstep = wstep.max((now - prev) / first);
                    prev = now;
                    least = least.min(now);
                }
                if gained > 1e-9 {
                    n += 1;
                }
                worst = worst.max(gained);
            }
            println!("A {name} e {e} mu {mu} h {h}: {n} gain, worst {worst:.2e} step {wstep:.2e}");
        }
    }
}
fn c_(h: f64, g: f64) {
    let (mut bad, mut worst) = (0, 0.0f64);
    for slip in [0.0, 0.1, 0.5, 1.0, 4.0] {
        for vn in [0.1, 0.2, 0.4] {
            for k in 0..40 {
                let gap = 0.002 + 0.003 * f64::from(k) / 39.0;
                let mut c = cfg(h);
                c.gravity = Vec3::new(0., 0., -g);
                let (mut w, cmd) = world(
                    c,
                    &[(bx(10., 10., 0.1), Pose::translation(0., 0., -0.05), 0.5)],
                    None,
                    &[(
                        vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.02 })],
                        0.05,
                        0.5,
                        0.9,
                        Pose::translation(0., 0., 0.02 + gap),
                        Vec3::new(slip, 0., -vn),
                        Vec3::ZERO,
                    )],
                );
                let met = (vn * vn + 2. * g * gap).sqrt();
                let mut found = 0.0;
                for _ in 0..(0.2 / h) as usize {
                    w.step(&cmd);
                    let v = w.state().v[2];
                    if v > 0.01 {
                        let z = w.state().objects[0].translation.z - 0.02;
                        found = (v * v + 2. * g * z).sqrt();
                        break;
                    }
                }
                let err = (found / (0.9 * met) - 1.0).abs();
                if err > 0.01 {
                    bad += 1;
                    if bad < 3 {
                        println!("   slip {slip} vn {vn} gap {gap}: {found} of {}", 0.9 * met);
                    }
                }
                worst = worst.max(err);
            }
        }
    }
    println!("C h {h} g {g}: bad {bad} of 600, worst {worst:.3e}");
}
fn spin(h: f64) {
    let (mut w, c) = world(
        cfg(h),
        &[],
        Some(0.3),
        &[(
            vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.03 })],
            0.1,
            0.3,
            0.0,
            Pose::translation(0., 0., 0.03),
            Vec3::new(1., 0., 0.),
            Vec3::new(0., -150., 50.),
        )],
    );
    for _ in 0..(0.5 / h) as usize {
        w.step(&c);
    }
    println!("H h {h}: wz {} vy {} vx {}", w.state().v[5], w.state().v[1], w.state().v[0]);
}
fn top(h: f64) {
    // cone-like top: capsule tip + disc
    let parts = vec![
        (Pose::translation(0., 0., 0.04), Shape::Cylinder { radius: 0.03, half_length: 0.005 }),
        (Pose::translation(0., 0., 0.02), Shape::Capsule { radius: 0.004, half_length: 0.016 }),
    ];
    for lean in [0.1, 0.3] {
        for s in [100.0, 200.0] {
            let q = Rotation::from_rotation_x(lean);
            let axis = q * Vec3::Z;
            let (mut w, c) = world(
                cfg(h),
                &[],
                Some(0.0),
                &[(
                    parts.clone(),
                    0.1,
                    0.0,
                    0.0,
                    Pose::from_parts(Vec3::new(0., 0., 0.0), q),
                    Vec3::ZERO,
                    axis * s,
                )],
            );
            // set on ground: central pose offset
            let lowest = (q * Vec3::new(0., 0., 0.0)).z;
            let _ = lowest;
            let com = w.state().objects[0];
            let tip = 0.004; // tip centre at z=0.004 local
            let local = com.inverse() * Pose::IDENTITY;
            let _ = local;
            // tip centre world = q*(0,0,.004)
            let z = (q * Vec3::new(0., 0., 0.004)).z;
            let up = tip - z;
            w.state_mut().objects[0].translation.z += up;
            let lz = |w: &World| {
                let r = Mat3::from_quat(w.state().objects[0].rotation);
                let om = Vec3::from_slice(&w.state().v[3..6]);
                (r * (w.model().objects()[0].inertia * (r.transpose() * om))).z
            };
            let l0 = lz(&w);
            let e0 = energy(&w, 0);
            let mut dev = 0.0f64;
            for _ in 0..(5.0 / h) as usize {
                w.step(&c);
                dev = dev.max((lz(&w) / l0 - 1.0).abs());
            }
            println!(
                "I h {h} lean {lean} spin {s}: Lz {:+.4} % (max {:.4}) energy {:+.4} %",
                100. * (lz(&w) / l0 - 1.0),
                100. * dev,
                100. * (energy(&w, 0) / e0 - 1.0)
            );
        }
    }
}
fn coin(h: f64) {
    for mu in [0.3, 4.0] {
        let (r, hh, m) = (0.04, 0.003, 0.05);
        let lean = 1.1f64; // axis tilts from vertical? lean of the disc plane
        let q = Rotation::from_rotation_x(lean);
        let axis = q * Vec3::Z;
        let z = r * lean.sin() + hh * lean.cos();
        let om = axis * 25.0 + Vec3::Z * 4.0;
        // rolling without slip: v = -om x (contact - com)
        let down = {
            let d = -(Vec3::Z - axis * axis.z).normalize();
            d * r - axis * hh * axis.z.signum()
        };
        let v = -(om.cross(down));
        let (mut w, c) = world(
            cfg(h),
            &[],
            Some(mu),
            &[(
                vec![(Pose::IDENTITY, Shape::Cylinder { radius: r, half_length: hh })],
                m,
                mu,
                0.0,
                Pose::from_parts(Vec3::new(0., 0., z), q),
                v,
                om,
            )],
        );
        let e0 = energy(&w, 0);
        let mut hop = 0.0f64;
        let mut off = 0.0f64;
        for _ in 0..(1.0 / h) as usize {
            w.step(&c);
            let p = w.state().objects[0];
            let ax = p.rotation * Vec3::Z;
            let d = -(Vec3::Z - ax * ax.z).normalize();
            let low = p.translation + d * r - ax * hh * ax.z.signum();
            hop = hop.max(low.z);
            for f in w.contact_forces() {
                off = off.max((f.position - low).length());
            }
        }
        println!(
            "G h {h} mu {mu}: energy {:+.3} % hop {:.2e} contact off {:.2e}",
            100. * (energy(&w, 0) / e0 - 1.0),
            hop,
            off
        );
    }
}
fn sleeve(h: f64) {
    let parts = vec![
        (Pose::translation(0.022, 0., 0.), bx(0.012, 0.056, 0.03)),
        (Pose::translation(-0.022, 0., 0.), bx(0.012, 0.056, 0.03)),
        (Pose::translation(0., 0.022, 0.), bx(0.032, 0.012, 0.03)),
        (Pose::translation(0., -0.022, 0.), bx(0.032, 0.012, 0.03)),
    ];
    let (mut lo, mut hi) = (9.0f64, 0.0f64);
    for k in 0..10 {
        let z0 = 0.13 + 0.00137 * f64::from(k);
        let (mut w, c) = world(
            cfg(h),
            &[(bx(0.03, 0.03, 0.1), Pose::translation(0., 0., 0.05), 0.0)],
            None,
            &[(
                parts.clone(),
                0.1,
                0.0,
                0.0,
                Pose::translation(0., 0., z0),
                Vec3::new(0., 0., -1.0),
                Vec3::ZERO,
            )],
        );
        let n = (0.08 / h).round() as usize;
        for _ in 0..n {
            w.step(&c);
        }
        let kept = w.state().v[2] / -(1.0 + 9.81 * h * n as f64);
        lo = lo.min(kept);
        hi = hi.max(kept);
    }
    let (mut l2, mut l3) = (9.0f64, 9.0f64);
    for speed in [0.5, 1.0, 2.0] {
        for clear in [0.0002, 0.0005, 0.001] {
            for k in 0..10 {
                let mut c = cfg(h);
                c.gravity = Vec3::ZERO;
                for ball in [true, false] {
                    let shape = if ball { Shape::Sphere { radius: 0.03 } } else { bx(0.06, 0.06, 0.06) };
                    let (mut w, cmd) = world(
                        c.clone(),
                        &[(bx(0.3, 0.3, 0.02), Pose::translation(0., 0., -0.01), 0.0)],
                        None,
                        &[(
                            vec![(Pose::IDENTITY, shape)],
                            0.1,
                            0.0,
                            0.0,
                            Pose::translation(0.15 + 0.03 + clear, 0., 0.06 + 0.00137 * f64::from(k)),
                            Vec3::new(0., 0., -speed),
                            Vec3::ZERO,
                        )],
                    );
                    for _ in 0..(0.15 / speed / h) as usize {
                        w.step(&cmd);
                    }
                    let kept = w.state().v[2] / -speed;
                    if ball { l2 = l2.min(kept) } else { l3 = l3.min(kept) }
                }
            }
        }
    }
    println!("B h {h}: kept {lo:.4} to {hi:.4}; ball {l2:.6} box {l3:.6}");
}
fn sleepy(h: f64) {
    for slope in [1e-4, 2e-4, 5e-4] {
        let c = Config { gravity: Vec3::new(-9.81 * slope, 0., -9.81), ..Config::with_step(h) };
        let (mut w, cmd) = world(
            c,
            &[],
            Some(0.5),
            &[(
                vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.03 })],
                0.1,
                0.5,
                0.0,
                Pose::translation(0., 0., 0.03),
                Vec3::new(0.004, 0., 0.),
                Vec3::new(0., 0.004 / 0.03, 0.),
            )],
        );
        for _ in 0..(20.0 / h) as usize {
            w.step(&cmd);
        }
        let a = 9.81 * slope * 5. / 7.;
        println!(
            "F h {h} slope {slope}: x {:.4} of {:.4} asleep {} forces {}",
            w.state().objects[0].translation.x,
            0.004 * 20. - 0.5 * a * 400.,
            w.state().sleep[0].asleep,
            w.contact_forces().len()
        );
    }
    let (mut w, cmd) = world(
        Config::with_step(h),
        &[],
        Some(0.5),
        &[(
            vec![(Pose::IDENTITY, bx(0.1, 0.1, 0.1))],
            0.3,
            0.5,
            0.0,
            Pose::translation(0., 0., 0.05),
            Vec3::ZERO,
            Vec3::ZERO,
        )],
    );
    for _ in 0..(1.0 / h) as usize {
        w.step(&cmd);
    }
    println!(
        "F rest h {h}: asleep {} force {}",
        w.state().sleep[0].asleep,
        w.contact_forces().iter().map(|f| f.force.z).sum::<f64>()
    );
}
fn placed(h: f64) {
    for thick in [0.01, 0.04, 0.5] {
        for (name, shape, r) in
            [("ball", Shape::Sphere { radius: 0.03 }, 0.03), ("box", bx(0.06, 0.06, 0.06), 0.03)]
        {
            let mut out = vec![];
            for d in [0.002, 0.005, 0.01, 0.03] {
                let (mut w, c) = world(
                    cfg(h),
                    &[(bx(0.5, 0.5, thick), Pose::translation(0., 0., -thick / 2.), 0.5)],
                    None,
                    &[(
                        vec![(Pose::IDENTITY, shape.clone())],
                        0.1,
                        0.5,
                        0.0,
                        Pose::translation(0., 0., r + 0.2),
                        Vec3::ZERO,
                        Vec3::ZERO,
                    )],
                );
                w.step(&c);
                w.step(&c);
                let st = w.state_mut();
                st.objects[0] = Pose::translation(0., 0., r - d);
                st.v.fill(0.0);
                let mut fast = 0.0f64;
                for _ in 0..(1.0 / h) as usize {
                    w.step(&c);
                    fast = fast.max(Vec3::from_slice(&w.state().v[..3]).length());
                }
                out.push(format!("{fast:.3}(z {:.4})", w.state().objects[0].translation.z - r));
            }
            println!("N h {h} thick {thick} {name}: {}", out.join(" "));
        }
    }
}
fn dead(h: f64) {
    let mut c = cfg(h);
    c.gravity = Vec3::ZERO;
    let mut out = vec![];
    for m in [0.02, 0.05, 0.2] {
        let (mut w, cmd) = world(
            c.clone(),
            &[],
            None,
            &[
                (
                    vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.02 })],
                    m,
                    0.3,
                    0.0,
                    Pose::translation(0., 0., 0.05),
                    Vec3::new(0., 0., -1.),
                    Vec3::ZERO,
                ),
                (
                    vec![(Pose::IDENTITY, bx(0.2, 0.2, 0.02))],
                    1.0,
                    0.3,
                    0.0,
                    Pose::translation(0., 0., 0.),
                    Vec3::ZERO,
                    Vec3::ZERO,
                ),
            ],
        );
        for _ in 0..(0.3 / h) as usize {
            w.step(&cmd);
        }
        out.push(format!("{:.3}", 100. * (w.state().v[2] - w.state().v[8])));
    }
    println!("L plate h {h}: {} % of speed", out.join(" "));
}
fn palm(h: f64) {
    let mut hand = Hand::clone(&Hand::builtin("softhand").unwrap());
    let _ = &mut hand;
}
fn rack(h: f64) {
    let mut c = cfg(h);
    c.gravity = Vec3::ZERO;
    let r = 0.0286;
    let mut objs = vec![(
        vec![(Pose::IDENTITY, Shape::Sphere { radius: r })],
        0.17,
        0.0,
        1.0,
        Pose::translation(-0.3, 0., 0.),
        Vec3::new(7., 0., 0.),
        Vec3::ZERO,
    )];
    for row in 0..5 {
        for k in 0..=row {
            objs.push((
                vec![(Pose::IDENTITY, Shape::Sphere { radius: r })],
                0.17,
                0.0,
                1.0,
                Pose::translation(
                    f64::from(row) * r * 3f64.sqrt() * 1.0,
                    (2. * f64::from(k) - f64::from(row)) * r,
                    0.,
                ),
                Vec3::ZERO,
                Vec3::ZERO,
            ));
        }
    }
    let (mut w, cmd) = world(c, &[], None, &objs);
    for _ in 0..(0.2 / h) as usize {
        w.step(&cmd);
    }
    let v = |k: usize| Vec3::from_slice(&w.state().v[6 * k..6 * k + 3]);
    let mut worst = 0.0f64;
    let mut i = 1;
    let mut en = 0.0;
    for row in 0..5usize {
        for k in 0..=row {
            let (a, b) = (v(i + k), v(i + row - k));
            worst = worst.max((a.x - b.x).abs()).max((a.y + b.y).abs());
        }
        i += row + 1;
    }
    for k in 0..16 {
        en += 0.5 * 0.17 * v(k).length_squared();
    }
    println!("J h {h}: mirror off {worst:.3e} m/s, energy {:.6} of 1", en / (0.5 * 0.17 * 49.));
}
fn main() {
    let which = std::env::args().nth(1).unwrap_or("ACHIGBFNLJ".into());
    let steps: Vec<f64> = std::env::args()
        .nth(2)
        .map(|s| s.split(',').map(|x| x.parse::<f64>().unwrap() * 1e-3).collect())
        .unwrap_or(vec![0.25e-3, 1e-3, 4e-3, 8e-3]);
    for ch in which.chars() {
        for &h in &steps {
            match ch {
                'A' => a(h),
                'C' => {
                    c_(h, 0.0);
                    c_(h, 9.81)
                }
                'H' => spin(h),
                'I' => top(h),
                'G' => coin(h),
                'B' => sleeve(h),
                'F' => sleepy(h),
                'N' => placed(h),
                'L' => dead(h),
                'J' => rack(h),
                'D' => palm(h),
                _ => {}
            }
        }
    }
}
