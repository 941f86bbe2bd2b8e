//! Points, vectors and normals: three types over one SIMD register each, so that only what has a meaning compiles.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub};

use glam::{DVec3, Vec3A};

macro_rules! triple {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Debug, Default)]
        #[repr(transparent)]
        pub struct $name(pub Vec3A);

        impl $name {
            /// All components zero.
            pub const ZERO: Self = Self(Vec3A::ZERO);

            /// From components.
            #[inline]
            pub const fn new(x: f32, y: f32, z: f32) -> Self {
                Self(Vec3A::new(x, y, z))
            }

            /// First component.
            #[inline]
            pub fn x(self) -> f32 {
                self.0.x
            }

            /// Second component.
            #[inline]
            pub fn y(self) -> f32 {
                self.0.y
            }

            /// Third component.
            #[inline]
            pub fn z(self) -> f32 {
                self.0.z
            }

            /// Absolute value of each component.
            #[inline]
            pub fn abs(self) -> Self {
                Self(self.0.abs())
            }

            /// Whether every component is finite.
            #[inline]
            pub fn is_finite(self) -> bool {
                self.0.is_finite()
            }

            /// In double precision.
            #[inline]
            pub fn to_f64(self) -> DVec3 {
                self.0.as_dvec3()
            }

            /// Rounded to single precision.
            #[inline]
            pub fn from_f64(v: DVec3) -> Self {
                Self(v.as_vec3a())
            }
        }

        impl From<[f32; 3]> for $name {
            #[inline]
            fn from(v: [f32; 3]) -> Self {
                Self(Vec3A::from_array(v))
            }
        }

        impl From<$name> for [f32; 3] {
            #[inline]
            fn from(v: $name) -> Self {
                v.0.to_array()
            }
        }
    };
}

macro_rules! linear {
    ($name:ident) => {
        impl $name {
            /// Dot product.
            #[inline]
            pub fn dot(self, other: impl Into<Vec3>) -> f32 {
                self.0.dot(other.into().0)
            }

            /// Absolute value of the dot product.
            #[inline]
            pub fn abs_dot(self, other: impl Into<Vec3>) -> f32 {
                self.dot(other).abs()
            }

            /// Squared length.
            #[inline]
            pub fn length_squared(self) -> f32 {
                self.0.length_squared()
            }

            /// Unit length, same direction. Lengths from about 1e-19 to 1e19 are safe.
            #[inline]
            pub fn normalize(self) -> Self {
                Self(self.0.normalize())
            }

            /// Unit length whatever the scale, by way of f64; `None` for zero or non-finite input.
            #[inline]
            pub fn try_normalize(self) -> Option<Self> {
                self.to_f64().try_normalize().map(Self::from_f64)
            }

            /// Itself or its negative, whichever is on the side of `other`.
            #[inline]
            pub fn face_forward(self, other: impl Into<Vec3>) -> Self {
                if self.dot(other) < 0.0 { -self } else { self }
            }
        }

        impl Neg for $name {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }

        impl AddAssign for $name {
            #[inline]
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }

        impl Sub for $name {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }

        impl Mul<f32> for $name {
            type Output = Self;
            #[inline]
            fn mul(self, s: f32) -> Self {
                Self(self.0 * s)
            }
        }

        impl MulAssign<f32> for $name {
            #[inline]
            fn mul_assign(&mut self, s: f32) {
                self.0 *= s;
            }
        }

        impl Mul<$name> for f32 {
            type Output = $name;
            #[inline]
            fn mul(self, v: $name) -> $name {
                $name(v.0 * self)
            }
        }

        impl Div<f32> for $name {
            type Output = Self;
            #[inline]
            fn div(self, s: f32) -> Self {
                Self(self.0 / s)
            }
        }
    };
}

triple! {
    /// A position.
    Point3
}
triple! {
    /// A direction or displacement.
    Vec3
}
triple! {
    /// A surface normal; transforms by the inverse transpose.
    Normal3
}
linear!(Vec3);
linear!(Normal3);

impl Vec3 {
    /// Cross product.
    #[inline]
    pub fn cross(self, other: Vec3) -> Vec3 {
        Vec3(self.0.cross(other.0))
    }

    /// Length.
    #[inline]
    pub fn length(self) -> f32 {
        self.0.length()
    }
}

impl From<Normal3> for Vec3 {
    #[inline]
    fn from(n: Normal3) -> Vec3 {
        Vec3(n.0)
    }
}

impl From<Vec3> for Normal3 {
    #[inline]
    fn from(v: Vec3) -> Normal3 {
        Normal3(v.0)
    }
}

impl Sub for Point3 {
    type Output = Vec3;
    #[inline]
    fn sub(self, other: Point3) -> Vec3 {
        Vec3(self.0 - other.0)
    }
}

impl Add<Vec3> for Point3 {
    type Output = Point3;
    #[inline]
    fn add(self, v: Vec3) -> Point3 {
        Point3(self.0 + v.0)
    }
}

impl Sub<Vec3> for Point3 {
    type Output = Point3;
    #[inline]
    fn sub(self, v: Vec3) -> Point3 {
        Point3(self.0 - v.0)
    }
}

impl Point3 {
    /// Distance to another point.
    #[inline]
    pub fn distance(self, other: Point3) -> f32 {
        (self - other).length()
    }
}
