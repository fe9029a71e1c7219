//! Meshes made in code, as corners of triangles.

use crate::Vec3;
use crate::pieces::TriangleMesh;

pub(super) type Corners = Vec<[Vec3; 3]>;

/// A closed curve (r, z), counter-clockwise as seen with r to the right and z up, turned about z.
pub(super) fn turned(profile: &[[f64; 2]], steps: usize) -> Corners {
    let at = |[r, z]: [f64; 2], step: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * (step % steps) as f64 / steps as f64);
        Vec3::new(r * cos, r * sin, z)
    };
    let mut corners = Vec::new();
    for step in 0..steps {
        for (k, p) in profile.iter().enumerate() {
            let q = profile[(k + 1) % profile.len()];
            let (a, b, c, d) = (at(*p, step), at(*p, step + 1), at(q, step + 1), at(q, step));
            corners.extend([[a, b, c], [a, c, d]]);
        }
    }
    // On the axis triangles vanish.
    corners.retain(|[a, b, c]| a != b && b != c && c != a);
    corners
}

/// A ring of radius `large` with a round section of radius `small`.
pub(super) fn torus(large: f64, small: f64, steps: usize) -> Corners {
    let profile: Vec<[f64; 2]> = (0..steps / 2)
        .map(|k| {
            let (sin, cos) = libm::sincos(core::f64::consts::TAU * k as f64 / (steps / 2) as f64);
            [large + small * cos, small * sin]
        })
        .collect();
    turned(&profile, steps)
}

/// A cup of this radius, height and wall.
pub(super) fn cup(radius: f64, height: f64, wall: f64, steps: usize) -> Corners {
    let inner = radius - wall;
    turned(&[[0.0, 0.0], [radius, 0.0], [radius, height], [inner, height], [inner, wall], [0.0, wall]], steps)
}

/// A cup with a handle: half a ring whose ends reach into the wall.
pub(super) fn mug() -> Corners {
    let (radius, height, wall) = (0.04, 0.09, 0.004);
    let mut corners = cup(radius, height, wall, 48);
    let (large, small, steps, round) = (0.025, 0.005, 16, 12);
    let at = |step: usize, k: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::PI * (step as f64 / steps as f64 - 0.5));
        let (s, c) = libm::sincos(core::f64::consts::TAU * (k % round) as f64 / round as f64);
        let r = large + small * c;
        Vec3::new(radius - 0.002 + r * cos, small * s, 0.5 * height + r * sin)
    };
    let middle = |step: usize| {
        let (sin, cos) = libm::sincos(core::f64::consts::PI * (step as f64 / steps as f64 - 0.5));
        Vec3::new(radius - 0.002 + large * cos, 0.0, 0.5 * height + large * sin)
    };
    for k in 0..round {
        for step in 0..steps {
            let (a, b, c, d) = (at(step, k), at(step, k + 1), at(step + 1, k + 1), at(step + 1, k));
            corners.extend([[a, b, c], [a, c, d]]);
        }
        corners.push([middle(0), at(0, k + 1), at(0, k)]);
        corners.push([middle(steps), at(steps, k), at(steps, k + 1)]);
    }
    corners
}

/// The surface of unit cells of this size that are there.
pub(super) fn cells(size: f64, there: &dyn Fn([i32; 3]) -> bool, most: i32) -> Corners {
    let mut corners = Vec::new();
    let corner = |p: [i32; 3]| Vec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])) * size;
    for i in 0..most.pow(3) {
        let cell = [i / (most * most), i / most % most, i % most];
        if !there(cell) {
            continue;
        }
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0, 1] {
                let mut next = cell;
                next[axis] += 2 * side - 1;
                if next.iter().all(|x| (0..most).contains(x)) && there(next) {
                    continue;
                }
                let at = |du: i32, dv: i32| {
                    let mut p = cell;
                    p[axis] += side;
                    p[u] += du;
                    p[v] += dv;
                    corner(p)
                };
                let (a, b, c, d) = (at(0, 0), at(1, 0), at(1, 1), at(0, 1));
                corners.extend(if side == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
            }
        }
    }
    corners
}

/// Two arms of a square section: three cells of 2 cm.
pub(super) fn ell() -> Corners {
    cells(0.02, &|[x, y, z]| z == 0 && (x == 0 && y < 2 || y == 0 && x < 2), 2)
}

/// All triangles flipped.
pub(super) fn inside_out(corners: &Corners) -> Corners {
    corners.iter().map(|[a, b, c]| [*a, *c, *b]).collect()
}

/// The bytes of an STL file of these triangles.
pub(super) fn stl(corners: &Corners) -> Vec<u8> {
    TriangleMesh::new(corners).to_stl("made in a test")
}
