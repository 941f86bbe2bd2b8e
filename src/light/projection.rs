//! A point that projects a picture. Scene-file manual (`LightSource "projection"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum I` | 1 | radiant intensity, W/sr; multiplies the map |
//! | `spectrum scale` | 1 | multiplies as well |
//! | `float fov` | 45 | full angle along the shorter side of the picture in degrees |
//! | `string mapname` | a white square | the picture; its top row goes to the smallest y |
//!
//! The light is at the origin of light space and shines along +z. The picture is looked up bilinearly and repeats, so
//! that opposite edges blend within half a texel, as in pbrt-v3.

use glam::{DMat3, DVec2, Vec2, Vec3A};

use crate::image::Image;
use crate::image::mip::{MipMap, Wrap};
use crate::light::placed_map::Placement;
use crate::math::{Point3, Vec3};
use crate::sampling::cumulative::Cumulative;
use crate::spectrum::Rgb;

/// A projection light.
#[derive(Clone, Debug)]
pub struct ProjectionLight {
    p: Point3,
    intensity: Rgb,
    placement: Placement,
    map: MipMap,
    /// Half of the window's sides on the plane z = 1.
    half: Vec2,
    table: Table,
}

/// Chooses texels in proportion to the light that passes them.
#[derive(Clone, Debug)]
struct Table {
    rows: Cumulative,
    /// Sums within each row, one row after the other.
    columns: Vec<Cumulative>,
    /// Density per area of the plane z = 1, texel by texel.
    pdf_plane: Vec<f32>,
    /// Sum over the texels of luminance times solid angle.
    total: f64,
    /// Of the window.
    solid_angle: f64,
}

impl ProjectionLight {
    /// At `p`; `intensity`, in render-space units (W/sr times the squared length scale), multiplies a picture with
    /// non-negative finite values, top row first. `aspect` is the width of the window over its height, `fov` in
    /// (0, 180) its angle in degrees along the shorter side. `render_from_light` is the invertible linear part of the
    /// light's transform.
    ///
    /// `None` for a picture that is black everywhere.
    pub fn new(
        p: Point3,
        intensity: Rgb,
        map: Image,
        aspect: f64,
        fov: f32,
        render_from_light: DMat3,
    ) -> Option<Self> {
        let tan = (0.5 * f64::from(fov).to_radians()).tan();
        let half = DVec2::new(tan * aspect.max(1.0), tan * (1.0 / aspect).max(1.0));
        let table = Table::new(&map, half)?;
        Some(Self {
            p,
            intensity,
            placement: Placement::new(render_from_light),
            map: MipMap::new(map, Wrap::Repeat),
            half: half.as_vec2(),
            table,
        })
    }

    /// What multiplies the picture.
    pub(super) fn strength(&self) -> Rgb {
        self.intensity
    }

    /// Position.
    pub fn position(&self) -> Point3 {
        self.p
    }

    /// Place in the picture, in [0, 1]², of a direction of light space.
    #[inline]
    fn place(&self, in_light: Vec3A) -> Option<Vec2> {
        if !(in_light.z > 0.0) {
            return None;
        }
        let st = (Vec2::new(in_light.x, in_light.y) / (in_light.z * self.half) + 1.0) * 0.5;
        (st.min_element() >= 0.0 && st.max_element() <= 1.0).then_some(st)
    }

    /// Radiant intensity in the unit direction `w` of render space, away from the light.
    #[inline]
    pub fn intensity(&self, w: Vec3) -> Rgb {
        match self.place(self.placement.light_direction(w)) {
            Some(st) => self.intensity * self.map.bilinear::<Rgb>(0, st),
            None => Rgb::BLACK,
        }
    }

    /// Power in light space: exact for transforms that keep angles, up to the variation of the picture in a texel.
    pub fn power(&self) -> f64 {
        self.table.total * f64::from(self.intensity.luminance())
    }

    /// Draws a unit direction, texels in proportion to their light; with the intensity there and the density in sr⁻¹.
    pub fn sample_direction(&self, u: [f32; 2]) -> Option<(Vec3, Rgb, f32)> {
        let level = self.map.level(0);
        let (row, y) = self.table.rows.sample(u[1]);
        let (column, x) = self.table.columns[row].sample(u[0]);
        let size = Vec2::new(level.width() as f32, level.height() as f32);
        let st = Vec2::new(column as f32 + x, row as f32 + y) / size;
        let on_plane = ((st * 2.0 - 1.0) * self.half).extend(1.0);
        let (w, jacobian) = self
            .placement
            .render_direction(Vec3A::from(on_plane.normalize()));
        let pdf_plane = self.table.pdf_plane[row * level.width() + column];
        let pdf_w = pdf_plane * on_plane.length().powi(3) * jacobian;
        (pdf_w > 0.0).then(|| (w, self.intensity * self.map.bilinear::<Rgb>(0, st), pdf_w))
    }

    /// Density of [`ProjectionLight::sample_direction`] in sr⁻¹.
    pub fn pdf_direction(&self, w: Vec3) -> f32 {
        let in_light = self.placement.light_direction(w);
        let Some(st) = self.place(in_light) else {
            return 0.0;
        };
        let level = self.map.level(0);
        let index = |c: f32, n: usize| ((c * n as f32) as usize).min(n - 1);
        let (column, row) = (index(st.x, level.width()), index(st.y, level.height()));
        let pdf_plane = self.table.pdf_plane[row * level.width() + column];
        // The area of the plane that a solid angle covers grows by 1 / cos³.
        pdf_plane * in_light.z.powi(-3) * self.placement.jacobian(in_light)
    }

    /// Luminance of the intensity, on average over the window.
    pub fn mean_intensity(&self) -> f64 {
        f64::from(self.intensity.map(f32::abs).luminance()) * self.table.total
            / self.table.solid_angle
    }

    /// Unit axis in render space, and the half angle of a cone around it that holds all light, in radians.
    pub fn cone(&self) -> (Vec3, f32) {
        let (axis, _) = self.placement.render_direction(Vec3A::Z);
        (axis, self.placement.widen(self.half.length().atan()))
    }
}

impl Table {
    fn new(map: &Image, half: DVec2) -> Option<Self> {
        let (width, height) = (map.width(), map.height());
        let luminance = |x: usize, y: usize| f64::from(map.rgb(x, y).luminance());
        // Mean of the bilinear look-up over a texel: it reaches half way into its neighbours.
        let mean = |x: usize, y: usize| {
            let row = |y: usize| {
                let (before, after) = ((x + width - 1) % width, (x + 1) % width);
                (luminance(before, y) + 6.0 * luminance(x, y) + luminance(after, y)) / 8.0
            };
            (row((y + height - 1) % height) + 6.0 * row(y) + row((y + 1) % height)) / 8.0
        };
        // Solid angle of the rectangle from the axis to a corner on the plane z = 1.
        let from_axis = |x: usize, y: usize| {
            let n = DVec2::new(width as f64, height as f64);
            let p = (DVec2::new(x as f64, y as f64) / n * 2.0 - 1.0) * half;
            (p.x * p.y / (1.0 + p.length_squared()).sqrt()).atan()
        };
        let mut columns = Vec::with_capacity(height);
        let mut weights = Vec::with_capacity(width * height);
        let mut sums = Vec::with_capacity(height);
        for y in 0..height {
            let row: Vec<f64> = (0..width)
                .map(|x| {
                    let solid_angle =
                        from_axis(x + 1, y + 1) - from_axis(x, y + 1) - from_axis(x + 1, y)
                            + from_axis(x, y);
                    mean(x, y) * solid_angle.max(0.0)
                })
                .collect();
            columns.push(Cumulative::new(&row));
            sums.push(row.iter().sum::<f64>());
            weights.extend(row);
        }
        let total: f64 = sums.iter().sum();
        if !(total > 0.0) {
            return None;
        }
        let texel_area = 4.0 * half.x * half.y / (width * height) as f64;
        let pdf_plane = weights.iter().map(|w| (w / total / texel_area) as f32);
        Some(Self {
            rows: Cumulative::new(&sums),
            columns,
            pdf_plane: pdf_plane.collect(),
            total,
            solid_angle: from_axis(width, height) - from_axis(0, height) - from_axis(width, 0)
                + from_axis(0, 0),
        })
    }
}
