//! How the links of a hand look, where its URDF says more than what they touch with.

use super::extract::{Asking, Segment};
use super::hands::{Whose, find, team};
use crate::problem::Problem;
use crate::state::AppState;
use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palmares_models::read::{Look, Visual};
use palmares_models::shape::Shape;
use schemars::JsonSchema;
use serde::Serialize;

/// What a part looks like.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum Form {
    /// As a shape that the physics knows, too.
    Shape(Shape),
    /// Triangles.
    Mesh(Mesh),
}

/// Triangles of a part.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "VisualMesh")]
struct Mesh {
    /// `mesh`
    #[serde(rename = "type")]
    kind: &'static str,
    /// Single-precision numbers, little endian, in base64: x, y, z of the three corners of each triangle, m.
    triangles: String,
}

/// A part of a link as it looks.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "VisualPart")]
struct Part {
    /// Name of the link.
    link: String,
    /// Where it is in the link's frame, m.
    position: [f64; 3],
    /// Unit quaternion.
    quat_xyzw: [f64; 4],
    shape: Form,
}

/// All parts; none for a hand that looks as it touches.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Visuals")]
pub(super) struct Visuals {
    parts: Vec<Part>,
}

fn form(look: Look) -> Form {
    match look {
        Look::Shape(shape) => Form::Shape(shape),
        Look::Mesh(triangles) => {
            let numbers = triangles.iter().flatten().flatten();
            let bytes: Vec<u8> = numbers.flat_map(|x| x.to_le_bytes()).collect();
            Form::Mesh(Mesh { kind: "mesh", triangles: STANDARD.encode(bytes) })
        }
    }
}

/// How the links of a hand look: of those who may know all of it.
pub(super) async fn visuals(
    State(app): State<AppState>,
    Segment(name): Segment,
    Asking(whose): Asking<Whose>,
    headers: HeaderMap,
) -> Result<Json<Visuals>, Problem> {
    if app.competition.hand(&name).is_some() {
        return Ok(Json(Visuals { parts: Vec::new() }));
    }
    let hand = find(&app, &headers, whose.clone(), &name).await?;
    let team = team(&app, &headers, whose).await?.unwrap_or_default();
    let seen = app.competition.own_hands.visuals(&app.store, &app.compute.background, &team, &name).await?;
    let part = |Visual { link, link_from_visual, look }: Visual| {
        Some(Part {
            link: hand.links.get(link)?.name.clone(),
            position: link_from_visual.translation.to_array(),
            quat_xyzw: link_from_visual.rotation.to_array(),
            shape: form(look),
        })
    };
    Ok(Json(Visuals { parts: seen.into_iter().filter_map(part).collect() }))
}
