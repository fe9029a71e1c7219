//! Other engines: the same cases on rapier, MuJoCo and Drake, the same grasps on rapier and MuJoCo, and the reports about them.
//!
//! | part | content |
//! |---|---|
//! | `compare/src/engine/` | the engines, and their named settings (`compare/src/engine/*/settings.rs`) |
//! | `compare/src/report/` | speed against error: docs/report |
//! | `compare/src/grasps/`, `compare/src/trials/` | the grasps that each engine holds; how a grasp is drawn and played |
//! | `compare/src/search/` | a search over the documented options of the other engines |
//! | `compare/src/cameras/` | times of pictures |
//! | `compare/src/validation/` | published measurements on real hands: docs/validation |

pub mod cameras;
pub mod child;
pub mod engine;
pub mod grasps;
pub mod mjcf;
pub mod peer_key;
pub mod played;
pub mod report;
pub mod scene_id;
pub mod search;
pub mod trials;
pub mod validation;
