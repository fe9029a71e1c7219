//! A `hand.toml` beside the document may state numbers. They are not written again.

use toml::{Table, Value};

use crate::draft::Draft;

/// Leaves out tendons, springs and loops that the settings state; `listed` has tendons that only they state.
pub(super) fn leave_out(draft: &mut Draft, settings: &str, listed: Option<&String>) {
    let Ok(table) = settings.parse::<Table>() else { return };
    let of = |name: &str| table.get(name).and_then(Value::as_table);
    let named = |table: &str, name: &str| of(table).is_some_and(|table| table.contains_key(name));
    let arms = |name: &str| {
        let own = of("tendons").and_then(|tendons| tendons.get(name)).and_then(Value::as_table);
        own.is_some_and(|own| own.contains_key("joints"))
    };
    let listed = |name: &str| listed.is_some_and(|list| list.split_whitespace().any(|other| other == name));
    draft.tendons.retain(|tendon| !arms(&tendon.name) && !listed(&tendon.name));
    draft.springs.retain(|spring| !named("springs", &spring.name));
    draft.loops.retain(|closed| !named("loops", &closed.name) && !named("linkages", &closed.name));
}
