use std::sync::{PoisonError, RwLock};

use arm_core::effect::{KINDS, Kind};

use crate::Refused;

/// The kinds that were declared, of a user's own; a later one of the same name takes the place of an earlier one.
static DECLARED: RwLock<Vec<Kind>> = RwLock::new(Vec::new());

fn declared() -> Vec<Kind> {
    DECLARED
        .read()
        .unwrap_or_else(PoisonError::into_inner)
        .clone()
}

/// Every kind of effect that a model may name: the catalogue, then those that were declared.
pub fn kinds() -> Vec<Kind> {
    KINDS.iter().copied().chain(declared()).collect()
}

/// The kind of a name.
pub fn kind(name: &str) -> Option<Kind> {
    let own = declared().into_iter().find(|k| k.info().kind == name);
    own.or_else(|| Kind::named(name).ok())
}

/// Declares a kind of a user's own; models may name it from then on.
///
/// # Errors
/// [`Refused`] for a name that the catalogue has.
pub fn declare(kind: Kind) -> Result<(), Refused> {
    let name = kind.info().kind;
    if Kind::named(name).is_ok() {
        return Err(Refused::new(
            "kind",
            name,
            "a name that the catalogue does not have",
        ));
    }
    let mut declared = DECLARED.write().unwrap_or_else(PoisonError::into_inner);
    declared.retain(|k| k.info().kind != name);
    declared.push(kind);
    Ok(())
}
