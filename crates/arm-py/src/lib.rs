//! Python module `armrs._armrs`.
