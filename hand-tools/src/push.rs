//! `--push link:fx,fy,fz`: constant forces on links.

use crate::load::link_of;
use anyhow::{Context, bail};
use palmares_models::Vec3;
use palmares_models::hand::Hand;
use palmares_sim::Push;
use std::str::FromStr;

/// Largest force of a push, N.
const FORCE_LIMIT: f64 = 1e4;

/// A push on the command line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PushArg {
    /// Name of the link.
    link: String,
    /// World frame, N.
    force: Vec3,
}

impl FromStr for PushArg {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (link, force) = text.rsplit_once(':').context("valid: link:fx,fy,fz with a force in newtons")?;
        let force: Vec<f64> = force
            .split(',')
            .map(|x| x.trim().parse().with_context(|| format!("`{x}` is not a number")))
            .collect::<anyhow::Result<_>>()?;
        let &[x, y, z] = force.as_slice() else {
            bail!("a force has three parts, not {}; valid: link:fx,fy,fz", force.len());
        };
        let force = Vec3::new(x, y, z);
        if !(0.0..=FORCE_LIMIT).contains(&force.length()) {
            bail!("a force of {force} N; valid: at most {FORCE_LIMIT} N");
        }
        Ok(PushArg { link: link.to_owned(), force })
    }
}

impl PushArg {
    /// The push on a hand, at the link's centre of mass.
    pub(crate) fn on(&self, hand: &Hand) -> anyhow::Result<Push> {
        let link = link_of(hand, &self.link)?;
        Ok(Push { link, point: hand.links[link].inertia.com, force: self.force })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_link_and_force() {
        let push: PushArg = "index_distal:-1,0.5,2e-1".parse().expect("it is well-formed");
        assert_eq!(push.link, "index_distal");
        assert_eq!(push.force, Vec3::new(-1.0, 0.5, 0.2));
        for bad in ["index_distal", "a:1,2", "a:1,2,x", "a:1,2,nan", "a:1e9,0,0", "a:1,2,3,4"] {
            assert!(bad.parse::<PushArg>().is_err(), "{bad}");
        }
    }

    #[test]
    fn an_unknown_link_is_refused_with_the_valid_names() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let push: PushArg = "index_distal:1,0,0".parse().expect("it is well-formed");
        assert_eq!(hand.links[push.on(&hand).expect("the link is there").link].name, "index_distal");
        let wrong: PushArg = "tail:1,0,0".parse().expect("it is well-formed");
        let message = wrong.on(&hand).expect_err("there is no such link").to_string();
        assert!(message.contains("`tail`") && message.contains("thumb_distal"), "{message}");
    }
}
