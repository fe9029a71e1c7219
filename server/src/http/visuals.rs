//! Visual shapes of a hand's links, where its URDF has shapes other than the collision shapes.

use super::coding;
use super::extract::{Path, Query};
use super::hands::{TeamQuery, find, team};
use crate::http::state::AppState;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use palmares_models::read::{Look, Visual};
use palmares_models::shape::Shape;
use palmares_net::transport::problem::Problem;
use schemars::JsonSchema;
use serde::Serialize;

/// The shape of a part.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum Form {
    /// A shape of the physics.
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

/// A visual part of a link.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "VisualPart")]
struct Part {
    /// Name of the link.
    link: String,
    /// Position in the link's frame, m.
    position: [f64; 3],
    /// Unit quaternion.
    quat_xyzw: [f64; 4],
    shape: Form,
}

/// All visual parts; empty for a hand whose visual shapes are its collision shapes.
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

/// The visual shapes of a hand that the client may see.
pub(super) async fn visuals(
    State(app): State<AppState>,
    Path(name): Path,
    Query(query): Query<TeamQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    if app.competition.hand(&name).is_some() {
        return Ok(coding::json(&headers, &Visuals { parts: Vec::new() }));
    }
    let hand = find(&app, &headers, query.clone(), &name).await?;
    let team = team(&app, &headers, query).await?.unwrap_or_default();
    let visuals =
        app.competition.own_hands.visuals(&app.store, &app.compute.background, &team, &name).await?;
    let part = |Visual { link, link_from_visual, look }: Visual| {
        Some(Part {
            link: hand.links.get(link)?.name.clone(),
            position: link_from_visual.translation.to_array(),
            quat_xyzw: link_from_visual.rotation.to_array(),
            shape: form(look),
        })
    };
    Ok(coding::json(&headers, &Visuals { parts: visuals.into_iter().filter_map(part).collect() }))
}
