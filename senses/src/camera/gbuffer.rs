//! A picture: what every pixel shows.

/// What every pixel shows, row by row from the top left.
#[derive(Clone, Debug, Default)]
pub struct GBuffer {
    /// Distance along the optical axis, m; infinite where nothing is in range.
    pub depth: Vec<f64>,
    /// Index of the body; [`GBuffer::NOTHING`] where there is none.
    pub body: Vec<u16>,
    /// Unit normal of the surface in the optical frame, zero where there is none; if wanted.
    pub normal: Option<Vec<[f32; 3]>>,
    /// What was nearest so far: 1/z, and its place in the list of pieces.
    pub(super) inverse: Vec<f64>,
    pub(super) piece: Vec<u32>,
}

impl GBuffer {
    /// No body.
    pub const NOTHING: u16 = u16::MAX;

    /// Whether the next picture shall have normals.
    pub fn with_normals(&mut self, wanted: bool) {
        match (wanted, &self.normal) {
            (true, None) => self.normal = Some(Vec::new()),
            (false, Some(_)) => self.normal = None,
            _ => {}
        }
    }
}
