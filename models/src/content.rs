//! Content hash of a model, so that two programs can check that they use the same one.
//!
//! Every number is hashed with all its bits and every list with its length; the order is fixed.

use crate::camera::{Camera, Stereo};
use crate::hand::number::{Entry, Hashed, Numbers};
use crate::hand::path::TendonPath;
use crate::hand::sensors::{Accelerometer, JointEncoders, MotorSensor, Touch};
use crate::hand::tendon::TendonElement;
use crate::hand::uncertain::Range;
use crate::hand::{
    Coordinate, Geom, Guide, Hand, Hinge, HingeKind, Inertia, Joint, Link, Linkage, Motor, Pad, PadOn,
    Sensors, Spring, Start, TactilePatch, Tendon, TendonNumbers, Uncertain,
};
use crate::object::Object;
use crate::shape::Shape;
use crate::{Mat3, Pose, Vec3};
use sha2::{Digest, Sha256};

/// SHA-256 over typed values.
#[derive(Clone, Default)]
pub struct ContentHash(Sha256);

impl ContentHash {
    /// A hash that begins with the kind of content.
    pub fn of(kind: &str) -> Self {
        let mut hash = ContentHash::default();
        hash.text(kind);
        hash
    }

    /// Hashes a count or an index.
    pub fn count(&mut self, n: usize) {
        self.0.update((n as u64).to_le_bytes());
    }

    /// Hashes a switch.
    pub fn flag(&mut self, on: bool) {
        self.count(usize::from(on));
    }

    /// Hashes a text.
    pub fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.update(text.as_bytes());
    }

    /// Hashes a number.
    pub fn float(&mut self, x: f64) {
        self.0.update(x.to_bits().to_le_bytes());
    }

    /// Hashes numbers whose count is known.
    pub fn floats(&mut self, xs: &[f64]) {
        for &x in xs {
            self.float(x);
        }
    }

    /// Hashes a vector.
    pub fn vector(&mut self, v: Vec3) {
        self.floats(&v.to_array());
    }

    /// Hashes a pose.
    pub fn pose(&mut self, pose: &Pose) {
        self.vector(pose.translation);
        self.floats(&pose.rotation.to_array());
    }

    /// Hashes a matrix.
    pub fn matrix(&mut self, m: &Mat3) {
        self.floats(&m.to_cols_array());
    }

    /// Hashes a list.
    pub fn list<T>(&mut self, items: &[T], each: impl Fn(&mut Self, &T)) {
        self.count(items.len());
        for item in items {
            each(self, item);
        }
    }

    /// Hashes the numbers of a part: those that a hand need not have after their words, so that a hand without them has the hash from
    /// before they existed.
    pub fn numbers(&mut self, part: &impl Numbers) {
        for (number, entry) in part.entries() {
            match (number.hashed, entry) {
                (Hashed::Always, Entry::Number(x)) => self.float(x),
                (Hashed::After(word), Entry::Number(x)) if x != 0.0 => {
                    self.text(word);
                    self.float(x);
                }
                _ => {}
            }
        }
    }

    /// Hashes a shape.
    pub fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Sphere { radius } => {
                self.text("sphere");
                self.float(*radius);
            }
            Shape::Capsule { radius, half_length } => {
                self.text("capsule");
                self.floats(&[*radius, *half_length]);
            }
            Shape::Cylinder { radius, half_length } => {
                self.text("cylinder");
                self.floats(&[*radius, *half_length]);
            }
            Shape::Box { half_extents, rounding } => {
                self.text("box");
                self.floats(half_extents);
                self.float(*rounding);
            }
            Shape::Hull { points, rounding } => {
                self.text("hull");
                self.list(points, |h, p| h.floats(p));
                self.float(*rounding);
            }
        }
    }

    /// Lower-case hexadecimal, 64 digits.
    pub fn to_hex(self) -> String {
        self.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

// The structs are destructured by name, so that a new field cannot be forgotten here.

impl Hand {
    /// SHA-256 of everything that the hand's behaviour depends on, 64 hexadecimal digits.
    pub fn content_hash(&self) -> String {
        let Hand {
            name,
            description: _,
            links,
            coordinates,
            tendons,
            springs,
            linkages,
            motors,
            gravity_compensation,
            no_collision,
            tactile,
            sensors,
            pads,
            start,
            // Other hands: see `Hand::uncertain_hash`.
            uncertain: _,
            // A name for places, not behaviour.
            base_from_root: _,
        } = self;
        let mut hash = ContentHash::of("palmares hand 1");
        hash.text(name);
        hash.list(links, link);
        hash.list(coordinates, coordinate);
        hash.list(tendons, tendon);
        hash.list(motors, |h, Motor { name, numbers }| {
            h.text(name);
            h.numbers(numbers);
        });
        hash.flag(*gravity_compensation);
        hash.list(no_collision, |h, [a, b]| {
            h.count(*a);
            h.count(*b);
        });
        hash.list(tactile, |h, TactilePatch { name, link, link_from_patch, half_size, taxels }| {
            h.text(name);
            h.count(*link);
            h.pose(link_from_patch);
            h.floats(half_size);
            taxels.iter().for_each(|n| h.count(*n));
        });
        hash_sensors(&mut hash, sensors);
        // A hand without pads has the same hash as before pads existed.
        if !pads.is_empty() {
            hash.list(pads, |h, PadOn { link, geom, pad: Pad { thickness, modulus } }| {
                h.count(*link);
                h.count(*geom);
                h.flag(thickness.is_some());
                h.floats(&[thickness.unwrap_or(0.0), *modulus]);
            });
        }
        if *start != Start::default() {
            hash.text("start");
            hash.list(&start.sigma, |h, x| h.float(*x));
            hash.list(&start.q, |h, x| h.float(*x));
        }
        // The same for springs across joints and linkages.
        if !springs.is_empty() || !linkages.is_empty() {
            hash.list(springs, |h, Spring { name, arms, numbers }| {
                h.text(name);
                h.list(arms, |h, (coordinate, arm)| {
                    h.count(*coordinate);
                    h.float(*arm);
                });
                h.numbers(numbers);
            });
            hash.list(linkages, |h, Linkage { name, links, points, numbers }| {
                h.text(name);
                links.iter().for_each(|link| h.count(*link));
                points.iter().for_each(|point| h.vector(*point));
                h.numbers(numbers);
            });
        }
        hash.to_hex()
    }

    /// SHA-256 of its uncertain numbers, 64 hexadecimal digits. They are no part of [`Hand::content_hash`]: the hand itself does not
    /// depend on them.
    pub fn uncertain_hash(&self) -> String {
        let mut hash = ContentHash::of("palmares uncertain hand 1");
        hash.list(&self.uncertain, |h, Uncertain { name, of, on, everywhere: _, range }| {
            h.text(name);
            h.text(of.name());
            h.list(on, |h, k| h.count(*k));
            h.flag(matches!(range, Range::Value(_)));
            h.floats(&range.ends());
        });
        hash.to_hex()
    }
}

impl Object {
    /// Hashes everything that the object's behaviour depends on.
    pub fn digest(&self, hash: &mut ContentHash) {
        let Object {
            name,
            parts,
            mass,
            com,
            inertia,
            friction,
            rolling_friction,
            torsional_friction,
            restitution,
        } = self;
        hash.text(name);
        hash.list(parts, |h, (pose, shape)| {
            h.pose(pose);
            h.shape(shape);
        });
        hash.vector(*com);
        hash.matrix(inertia);
        hash.floats(&[*mass, *friction, *rolling_friction, *torsional_friction, *restitution]);
    }
}

fn link(hash: &mut ContentHash, link: &Link) {
    let Link { name, parent, joint, inertia: Inertia { mass, com, about_com }, geoms } = link;
    hash.text(name);
    hash.count(parent.map_or(0, |p| p + 1));
    hash.flag(joint.is_some());
    if let Some(Joint { name, coordinate, hinges }) = joint {
        hash.text(name);
        hash.count(*coordinate);
        hash.list(hinges, |h, Hinge { parent_from_hinge, axis, kind, ratio, offset }| {
            h.pose(parent_from_hinge);
            h.vector(*axis);
            h.flag(*kind == HingeKind::Prismatic);
            h.floats(&[*ratio, *offset]);
        });
    }
    hash.float(*mass);
    hash.vector(*com);
    hash.matrix(about_com);
    hash.list(geoms, |h, Geom { link_from_geom, shape, friction }| {
        h.pose(link_from_geom);
        h.shape(shape);
        h.float(*friction);
    });
}

fn hash_sensors(hash: &mut ContentHash, sensors: &Sensors) {
    let Sensors { motors, joints, touch, accelerometer, cameras } = sensors;
    let MotorSensor { resolution, bias, tension_noise, tension_gain } = motors;
    hash.floats(&[*resolution, *bias, *tension_noise, *tension_gain]);
    hash.flag(joints.is_some());
    if let Some(JointEncoders { on, resolution, bias, noise }) = joints {
        hash.list(on, |h, name| h.text(name));
        hash.floats(&[*resolution, *bias, *noise]);
    }
    let Touch { footprint, depth, shear, resolution, saturation, noise, rate_hz } = touch;
    hash.flag(*shear);
    hash.floats(&[*footprint, *depth, *resolution, *saturation, *noise, *rate_hz]);
    hash.flag(accelerometer.is_some());
    if let Some(Accelerometer { link, range, noise, bias }) = accelerometer {
        hash.text(link);
        hash.floats(&[*range, *noise, *bias]);
    }
    hash.list(cameras, camera);
}

fn camera(hash: &mut ContentHash, camera: &Camera) {
    let Camera {
        name,
        link,
        position,
        quat_xyzw,
        width,
        height,
        fov_deg,
        near,
        far,
        depth_unit,
        stereo: Stereo { rate_hz, latency_s, baseline, disparity_noise, disparity_step, grazing_deg, dropout },
    } = camera;
    hash.text(name);
    hash.text(link.as_deref().unwrap_or_default());
    hash.floats(position);
    hash.floats(quat_xyzw);
    hash.count(*width as usize);
    hash.count(*height as usize);
    hash.floats(&[*fov_deg, *near, *far, *depth_unit]);
    hash.floats(&[*rate_hz, *latency_s, *baseline]);
    hash.floats(&[*disparity_noise, *disparity_step, *grazing_deg, *dropout]);
}

fn coordinate(hash: &mut ContentHash, coordinate: &Coordinate) {
    let Coordinate { name, lower, upper, numbers } = coordinate;
    hash.text(name);
    hash.floats(&[*lower, *upper]);
    hash.numbers(numbers);
}

fn tendon(hash: &mut ContentHash, tendon: &Tendon) {
    let Tendon { name, motors, moment_arms, elements, guides, numbers } = tendon;
    let TendonNumbers { rest, both_ways, hold_limit, breakaway, .. } = numbers;
    hash.text(name);
    // One motor of weight 1 has the same hash as before weights existed.
    match motors[..] {
        [(motor, 1.0)] if *rest == 0.0 => hash.count(motor),
        _ => {
            hash.text("motors");
            hash.list(motors, |h, (motor, weight)| {
                h.count(*motor);
                h.float(*weight);
            });
            hash.float(*rest);
        }
    }
    hash.list(moment_arms, |h, (coordinate, arm)| {
        h.count(*coordinate);
        h.float(*arm);
    });
    hash.list(elements, |h, TendonElement { coordinate, path }| {
        h.count(*coordinate);
        match path {
            TendonPath::DaVinci(mechanism) => {
                let g = mechanism.geometry();
                h.text("da_vinci");
                h.floats(&[g.r0, g.r1, g.r2, g.a1, g.b1, g.l1, g.a2, g.b2]);
            }
            TendonPath::Polynomial(polynomial) => {
                h.text("polynomial");
                h.list(&polynomial.coefficients, |h, c| h.float(*c));
            }
            TendonPath::Table(table) => {
                h.text("table");
                h.list(&table.points().at, |h, x| h.float(*x));
                h.list(&table.points().length, |h, x| h.float(*x));
            }
            TendonPath::Eyelets(eyelets) => {
                h.text("eyelets");
                h.floats(&eyelets.positions().before);
                h.floats(&eyelets.positions().after);
            }
        }
    });
    hash.flag(*both_ways);
    hash.numbers(numbers);
    if hold_limit.is_some() {
        hash.flag(*breakaway);
    }
    if !guides.is_empty() {
        hash.text("guides");
        hash.list(guides, |h, Guide { coordinate, numbers }| {
            h.count(*coordinate);
            h.numbers(numbers);
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::builtin::builtin_hands;

    #[test]
    fn hands_differ_and_repeat() {
        let hashes: Vec<String> = builtin_hands().iter().map(|hand| hand.content_hash()).collect();
        for (i, a) in hashes.iter().enumerate() {
            assert_eq!(a.len(), 64);
            assert_eq!(*a, builtin_hands()[i].content_hash());
            assert!(hashes[..i].iter().all(|b| a != b));
        }
    }

    #[test]
    fn the_last_bit_counts_and_the_description_does_not() {
        let hand = &builtin_hands()[0];
        let mut other = (**hand).clone();
        other.description.push('!');
        assert_eq!(hand.content_hash(), other.content_hash());
        let e = &mut other.coordinates[3].stiffness;
        *e = f64::from_bits(e.to_bits() + 1);
        assert_ne!(hand.content_hash(), other.content_hash());
    }
}
