//! Text as a model and as a data set: refused, or written and read again without a change.
#![no_main]

use arm_model::{Description, Model};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(model) = Model::from_toml(text) {
        let again = Model::from_toml(&model.to_toml()).expect("what was written can be read");
        assert!(again == model, "{model:?}\n{again:?}");
        let _ = model.warnings();
        // With any number of joints: what is not this model's is refused.
        let _ = (
            model.setup::<1>(),
            model.setup::<2>(),
            model.setup::<3>(),
            model.setup::<6>(),
        );
        let _ = model.core_effects();
    }
    if let Ok(dataset) = Description::from_toml(text) {
        let again =
            Description::from_toml(&dataset.to_toml()).expect("what was written can be read");
        assert!(again == dataset, "{dataset:?}\n{again:?}");
    }
});
