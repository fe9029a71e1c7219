//! The G-buffer: depth, body and normal of every pixel.

/// An image, row by row from the top left.
#[derive(Clone, Debug, Default)]
pub struct GBuffer {
    /// Distance along the optical axis, m; infinite where nothing is in range.
    pub depth: Vec<f64>,
    /// Index of the body; [`GBuffer::NOTHING`] where there is none.
    pub body: Vec<u16>,
    /// Unit normal of the surface in the optical frame, zero where there is none. Absent unless [`GBuffer::with_normals`]
    /// turned normals on.
    pub normal: Option<Vec<[f32; 3]>>,
    /// 1/z of the nearest primitive that has been drawn, and its index.
    pub(super) inverse: Vec<f64>,
    pub(super) primitive: Vec<u32>,
}

impl GBuffer {
    /// No body.
    pub const NOTHING: u16 = u16::MAX;

    /// Turns the normals of the next image on or off.
    pub fn with_normals(&mut self, wanted: bool) {
        match (wanted, &self.normal) {
            (true, None) => self.normal = Some(Vec::new()),
            (false, Some(_)) => self.normal = None,
            _ => {}
        }
    }
}
