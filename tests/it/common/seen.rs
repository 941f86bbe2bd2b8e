//! What a camera sees, as scene text.

/// A vector in world space.
pub(crate) type V = [f64; 3];

/// A scene for an integrator.
pub(crate) fn seen_by(integrator: &str, max_depth: u32, eye: V, toward: V, world: &str) -> String {
    let [ex, ey, ez] = eye;
    let [tx, ty, tz] = [0, 1, 2].map(|k| eye[k] + toward[k]);
    // Any up vector that is not along the axis.
    let length = toward.iter().map(|x| x * x).sum::<f64>().sqrt();
    let up = if toward[1].abs() > 0.9 * length {
        "1 0 0"
    } else {
        "0 1 0"
    };
    format!(
        "Integrator \"{integrator}\" \"integer maxdepth\" {max_depth}\n\
         LookAt {ex} {ey} {ez} {tx} {ty} {tz} {up}\n\
         Camera \"perspective\"\nWorldBegin\n{world}\nWorldEnd\n"
    )
}

/// A constant environment.
pub(crate) fn environment(radiance: V) -> String {
    format!("LightSource \"infinite\" \"rgb L\" {radiance:?}\n").replace(',', "")
}
