//! What is placed inside furniture.

use super::at_most;

#[test]
fn what_is_placed_inside_furniture_leaves_slowly() {
    // Contacts part what is placed so at 0.2 m/s; bodies that start in each other part at 0.3 m/s, too.
    at_most("placed_inside", &[0.25e-3, 1e-3, 4e-3, 8e-3, 16e-3].map(|dt| (dt, 0.3)));
}
