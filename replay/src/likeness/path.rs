//! The path of a hand through a run: points at equal distances.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use palmares_tasks::Run;

/// Numbers of a point: position of the base, and the ends of two axes of the hand, which turn with it; its closing.
pub(super) const NUMBERS: usize = 10;
/// Length of the axes, mm: a turn by 0.1 rad counts as 5 mm.
const LEVER_MM: f64 = 50.0;
/// Weight of the mean σ of the motors, mm: to close counts as 30 mm.
const GRIP_MM: f64 = 30.0;
/// Period of the samples, s. Each is the mean of its ticks, and is smoothed over its two neighbours.
const PERIOD_S: f64 = 0.1;
/// Distance of neighbouring points of a path, mm; doubled until the path has at most [`MAX_POINTS`].
const STEP_MM: f64 = 10.0;
/// Number of points of the longest path: 45 kB, and a comparison of two of them visits four million pairs.
const MAX_POINTS: usize = 2048;
/// A shorter path says nothing: all idle runs are alike.
const MIN_POINTS: usize = 20;
/// Stored lengths are multiples of this, mm.
const UNIT_MM: f64 = 0.1;
/// Bytes of a stored point.
const POINT_BYTES: usize = 2 * (NUMBERS + 1);

/// A point of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// Where the hand is, mm.
    pub(super) at: [f64; NUMBERS],
    /// When, s since the begin of the run.
    pub(super) time_s: f64,
}

/// The path of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// Distance of its points, mm.
    pub(super) step_mm: f64,
    pub(super) points: Vec<Point>,
}

/// Records the path of a run.
#[derive(Debug)]
pub(super) struct Recorder {
    ticks_per_sample: u32,
    period_s: f64,
    /// Sum and number of the ticks of the present sample.
    sum: [f64; NUMBERS],
    ticks: u32,
    samples: Vec<[f64; NUMBERS]>,
}

impl Recorder {
    /// For a run with this length of a tick, s.
    pub(super) fn new(tick_s: f64) -> Self {
        let ticks_per_sample = (PERIOD_S / tick_s).round().max(1.0) as u32;
        let period_s = f64::from(ticks_per_sample) * tick_s;
        Recorder { ticks_per_sample, period_s, sum: [0.0; NUMBERS], ticks: 0, samples: Vec::new() }
    }

    /// Takes the state after a tick.
    pub(super) fn see(&mut self, run: &Run) {
        let (base, motors) = (run.base_state(), run.motor_motion());
        let closing = motors.iter().map(|[sigma, _]| sigma).sum::<f64>() / (motors.len().max(1) as f64);
        self.add(base.position, base.quat_xyzw, closing);
    }

    /// Takes a pose of the base, m, and the mean σ of the motors.
    pub(super) fn add(&mut self, position: [f64; 3], [x, y, z, w]: [f64; 4], closing: f64) {
        let first = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
        let third = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
        let numbers = position.map(|x| 1e3 * x).into_iter();
        let numbers = numbers.chain(first.into_iter().chain(third).map(|x| LEVER_MM * x));
        for (sum, number) in self.sum.iter_mut().zip(numbers.chain([GRIP_MM * closing])) {
            *sum += number;
        }
        self.ticks += 1;
        if self.ticks == self.ticks_per_sample {
            let ticks = f64::from(self.ticks);
            self.samples.push(std::mem::take(&mut self.sum).map(|sum| sum / ticks));
            self.ticks = 0;
        }
    }

    /// The path.
    pub(super) fn finish(self) -> Path {
        let smooth = |k: usize| {
            let near = &self.samples[k.saturating_sub(1)..(k + 2).min(self.samples.len())];
            let mean = |i: usize| near.iter().map(|sample| sample[i]).sum::<f64>() / (near.len() as f64);
            Point { at: std::array::from_fn(mean), time_s: (k as f64 + 0.5) * self.period_s }
        };
        let samples: Vec<Point> = (0..self.samples.len()).map(smooth).collect();
        let mut step_mm = STEP_MM;
        let mut points = walk(&samples, step_mm);
        while points.len() > MAX_POINTS {
            step_mm *= 2.0;
            points = walk(&samples, step_mm);
        }
        let rounded = |x: f64| UNIT_MM * stored(x / UNIT_MM);
        for point in &mut points {
            point.at = point.at.map(rounded);
            point.time_s = (point.time_s / PERIOD_S).round().min(f64::from(u16::MAX)) * PERIOD_S;
        }
        Path { step_mm, points }
    }
}

/// A number as it is stored.
fn stored(x: f64) -> f64 {
    x.round().clamp(f64::from(i16::MIN), f64::from(i16::MAX))
}

pub(super) fn dot(a: &[f64; NUMBERS], b: &[f64; NUMBERS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn minus(a: &[f64; NUMBERS], b: &[f64; NUMBERS]) -> [f64; NUMBERS] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// Points on a polyline, each at a distance of one step from the one before. Movements smaller than a step make none.
fn walk(line: &[Point], step_mm: f64) -> Vec<Point> {
    let Some(first) = line.first() else { return Vec::new() };
    let mut points = vec![*first];
    let mut last = first.at;
    for ends in line.windows(2) {
        let along = minus(&ends[1].at, &ends[0].at);
        let square = dot(&along, &along);
        let moves = square > 0.0;
        if !moves {
            continue;
        }
        let mut from = 0.0;
        loop {
            // The farther of the two places of the line at that distance, if it lies ahead.
            let behind = minus(&std::array::from_fn(|k| ends[0].at[k] + from * along[k]), &last);
            let half = dot(&along, &behind);
            let root = half * half - square * (dot(&behind, &behind) - step_mm * step_mm);
            let further = (root.max(0.0).sqrt() - half) / square;
            // Also with numbers that are none.
            let ahead = root >= 0.0 && further > 0.0 && from + further <= 1.0;
            if !ahead {
                break;
            }
            from += further;
            last = std::array::from_fn(|k| ends[0].at[k] + from * along[k]);
            points
                .push(Point { at: last, time_s: ends[0].time_s + from * (ends[1].time_s - ends[0].time_s) });
        }
    }
    points
}

impl Path {
    /// Whether it is long enough to be compared.
    pub fn is_comparable(&self) -> bool {
        self.points.len() >= MIN_POINTS
    }

    /// Its points at this distance or, if they are farther apart, as they are.
    pub(super) fn with_step(&self, step_mm: f64) -> Vec<Point> {
        if step_mm > self.step_mm { walk(&self.points, step_mm) } else { self.points.clone() }
    }

    /// The path as text, for the database. Little-endian: the step as f32, then for each point the numbers in tenths of a millimetre
    /// as i16, and the time in tenths of a second as u16.
    pub fn to_text(&self) -> String {
        let mut bytes = (self.step_mm as f32).to_le_bytes().to_vec();
        for point in &self.points {
            for number in point.at {
                bytes.extend((stored(number / UNIT_MM) as i16).to_le_bytes());
            }
            bytes.extend(((point.time_s / PERIOD_S).round() as u16).to_le_bytes());
        }
        BASE64_STANDARD.encode(bytes)
    }

    /// The path of a text; None if it is none.
    pub fn of_text(text: &str) -> Option<Self> {
        let bytes = BASE64_STANDARD.decode(text).ok()?;
        let (step, points) = bytes.split_first_chunk::<4>()?;
        let step_mm = f64::from(f32::from_le_bytes(*step));
        if !(step_mm > 0.0 && step_mm.is_finite() && points.len() % POINT_BYTES == 0) {
            return None;
        }
        let point = |bytes: &[u8]| {
            let pair = |k: usize| [bytes[2 * k], bytes[2 * k + 1]];
            let at = std::array::from_fn(|k| UNIT_MM * f64::from(i16::from_le_bytes(pair(k))));
            Point { at, time_s: PERIOD_S * f64::from(u16::from_le_bytes(pair(NUMBERS))) }
        };
        Some(Path { step_mm, points: points.chunks_exact(POINT_BYTES).map(point).collect() })
    }
}
