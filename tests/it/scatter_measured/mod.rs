//! Scattering functions of many parameters: hair fibres, tables, the Disney material. Their samples follow their densities, their
//! energies agree by independent estimators, and extremes stay sound.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod disney;
mod fourier;
mod hair;

/// A scene under a uniform sky of radiance 1, seen from outside along +z.
fn lit(world: &str) -> String {
    format!(
        "LookAt 0.13 0.21 -5  0.15 0.18 -4  0 1 0\n\
         Camera \"perspective\" \"float fov\" 1\n\
         Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 1\n\
         Integrator \"path\" \"integer maxdepth\" 100\n\
         WorldBegin\nLightSource \"infinite\" \"rgb L\" [1 1 1]\n{world}\nWorldEnd\n"
    )
}
