//! Laws that a study can leave out, to find what each of them buys in a scene.

/// A law of a step that can be left out. `docs/physics.md` has its equation and its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::IntoStaticStr, strum::VariantArray)]
pub enum Law {
    /// Round and soft contacts resist spin.
    #[strum(serialize = "spin friction")]
    SpinFriction,
    /// A contact that sticks holds by a spring: without it, friction needs a slip speed.
    #[strum(serialize = "anchors")]
    Anchors,
    /// Friction of flat contacts acts nearer to the middle than their corners.
    #[strum(serialize = "patches")]
    Patches,
    /// A step in which slip begins or ends is solved again.
    #[strum(serialize = "slip correction")]
    SlipCorrection,
    /// The old support of an object that tips carries it until the new one is hit.
    #[strum(serialize = "support transfer")]
    SupportTransfer,
    /// Surfaces that only pass each other bear nothing.
    #[strum(serialize = "passing surfaces")]
    Passing,
    /// Blows with e = 0 of several bodies return nothing.
    #[strum(serialize = "dead blows")]
    DeadBlows,
    /// Rebounds with friction add no energy.
    #[strum(serialize = "blow energy")]
    BlowEnergy,
    /// Fast objects stop before they pass through others.
    #[strum(serialize = "continuous motion")]
    ContinuousMotion,
    /// The hand moves in second order where nothing holds it.
    #[strum(serialize = "second order, hand")]
    HandOrder,
    /// A lone object that slides or rolls moves in second order.
    #[strum(serialize = "second order, objects")]
    ObjectOrder,
    /// Links of the hand touch each other.
    #[strum(serialize = "self-contact")]
    SelfContact,
    /// Islands at rest stop.
    #[strum(serialize = "sleep")]
    Sleep,
}

impl Law {
    /// All of them.
    pub const ALL: &'static [Law] = <Law as strum::VariantArray>::VARIANTS;

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A set of laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Laws(u16);

impl Laws {
    /// Adds a law.
    pub fn insert(&mut self, law: Law) {
        self.0 |= 1 << law as u16;
    }

    /// Adds a law if `it_does`.
    pub fn insert_if(&mut self, law: Law, it_does: bool) {
        self.0 |= u16::from(it_does) << law as u16;
    }

    /// Whether it has a law.
    #[inline]
    pub fn contains(self, law: Law) -> bool {
        self.0 & 1 << law as u16 != 0
    }

    /// Its laws in order.
    pub fn iter(self) -> impl Iterator<Item = Law> {
        Law::ALL.iter().copied().filter(move |law| self.contains(*law))
    }
}
