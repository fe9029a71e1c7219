//! Limits for a hand's files: they may come from a stranger.
//!
//! Every error names the file, the element, the found value and the limit. Sizes are checked before anything
//! is computed from them, so that no file keeps a parser or a hull algorithm busy for long.

/// Limits for files. The defaults are several times the needs of the hands in `hands/`.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Bytes of a URDF or `hand.toml`. The published SoftHand's URDF has 60 kB.
    pub text_bytes: u64,
    /// Bytes of a description in `hand.toml`: everybody who watches a run gets it.
    pub description_bytes: usize,
    /// Bytes between `<` and `>` of one tag: parsers compare each attribute of a tag with every other.
    pub tag_bytes: usize,
    /// XML nodes of a URDF: elements, texts and comments.
    pub xml_nodes: u32,
    /// Nested XML elements; a URDF needs six.
    pub xml_depth: usize,
    /// Links of a hand, couplers and fixed ones included.
    pub links: usize,
    /// Joints of a hand.
    pub joints: usize,
    /// Links from the base to a fingertip, couplers and fixed ones included.
    pub depth: usize,
    /// Collision shapes of a link.
    pub link_shapes: usize,
    /// Collision shapes of all links.
    pub shapes: usize,
    /// Tendons of a hand.
    pub tendons: usize,
    /// Taxels of a hand's tactile patches.
    pub taxels: usize,
    /// Cameras on a hand.
    pub cameras: usize,
    /// Mesh files that a URDF names; the same file at another scale counts again.
    pub meshes: usize,
    /// Bytes of one mesh file.
    pub mesh_bytes: u64,
    /// Bytes of all mesh files together.
    pub mesh_total_bytes: u64,
    /// Corners of a mesh, three per triangle.
    pub mesh_vertices: usize,
    /// Corners of all meshes together.
    pub mesh_total_vertices: usize,
    /// Points of all meshes from which their hulls are made: of a mesh of more than
    /// [`THINNED_DIRECTIONS`](crate::shape::hull::THINNED_DIRECTIONS), the farthest along as many directions.
    pub mesh_hull_points: usize,
    /// Bytes of an archive.
    pub archive_bytes: u64,
    /// Files and folders in an archive.
    pub archive_entries: usize,
    /// Bytes of all files of an archive after unpacking.
    pub archive_unpacked_bytes: u64,
    /// Largest compression ratio of a file of more than a megabyte. Text compresses to a tenth, zeros to a
    /// thousandth.
    pub archive_ratio: u64,
    /// Largest size and distance, m.
    pub length_m: f64,
    /// Largest mass of a link, kg.
    pub mass_kg: f64,
    /// Largest magnitude of any other number, in its own SI unit. Keeps squares and sums finite.
    pub number: f64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            text_bytes: 1 << 20,
            description_bytes: 4096,
            tag_bytes: 16 << 10,
            xml_nodes: 100_000,
            xml_depth: 32,
            links: 256,
            joints: 256,
            depth: 64,
            link_shapes: 32,
            shapes: 512,
            tendons: 64,
            taxels: 1024,
            cameras: 8,
            meshes: 128,
            mesh_bytes: 16 << 20,
            mesh_total_bytes: 64 << 20,
            mesh_vertices: 300_000,
            mesh_total_vertices: 1_500_000,
            mesh_hull_points: 65_536,
            archive_bytes: 32 << 20,
            archive_entries: 1024,
            archive_unpacked_bytes: 96 << 20,
            archive_ratio: 100,
            length_m: 10.0,
            mass_kg: 100.0,
            number: 1e9,
        }
    }
}
