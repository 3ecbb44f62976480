//! Objects beside one another against the wave equation, the quick ones; all are in `accept`.

use sonel_tests::furniture::{errors, summary};

/// rms per octave from 63 Hz to 1 kHz [dB], a tenth above what docs/diffraction.md states for these.
const ALLOWED: [f64; 5] = [1.25, 1.1, 1.55, 0.95, 0.95];

#[test]
fn a_pillar_a_door_and_a_lectern_shade_as_waves_say() {
    let all = |with_edges: bool| ["pillar", "door", "lectern"].map(|name| errors(name, with_edges)).concat();
    let (rms, worst) = summary(&all(true));
    assert!(
        rms.iter().zip(ALLOWED).all(|(rms, allowed)| *rms < allowed) && worst < 5.0,
        "{rms:.2?} {worst:.1} dB"
    );
    let (without, _) = summary(&all(false));
    assert!(without.iter().all(|rms| *rms > 3.0), "silence is rejected: {without:.1?} dB");
}
