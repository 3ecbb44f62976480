//! Reflection at the border between two airs: any angle, any speeds and densities, any distance.

use sonel_tests::two_airs::check;

#[test]
fn two_thousand_borders_reflect_as_the_closed_form_says() {
    check(2000, 69);
}
