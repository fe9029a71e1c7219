//! Surfaces of shapes, computed when a model is made: faces, seams between parts, and torque that soft and round contacts hold.

pub mod seams;
pub mod solid;
pub mod spin;
