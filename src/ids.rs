//! Typed indices into the arenas of the world. Owns nothing, imports nothing.

macro_rules! id {
    ($(#[$doc:meta] $name:ident),* $(,)?) => {$(
        #[$doc]
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl Default for $name {
            fn default() -> Self {
                Self::NONE
            }
        }

        impl $name {
            /// The id that refers to nothing.
            pub const NONE: Self = Self(u32::MAX);

            /// Whether it refers to something.
            #[inline]
            pub fn is_some(self) -> bool {
                self != Self::NONE
            }

            /// The index behind the id.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }

            /// The id of an arena's entry. Arenas hold fewer than 2³² − 1 entries.
            #[inline]
            pub fn new(index: usize) -> Self {
                debug_assert!(index < u32::MAX as usize);
                Self(index as u32)
            }
        }
    )*};
}

id! {
    /// A shape with its material, media and light: one `Shape` directive.
    GeometryId,
    /// A material.
    MaterialId,
    /// A light.
    LightId,
    /// A participating medium; `NONE` is vacuum.
    MediumId,
    /// A texture among those of its value type.
    TextureId,
    /// A Ptex file.
    PtexId,
    /// Geometry that instances share.
    ObjectId,
    /// A placement of an object.
    InstanceId,
    /// A block of a medium, to which some of a sky comes through.
    BlockId,
    /// A table of a scattering function.
    FourierTableId,
    /// A decoded image with its pyramid.
    ImageId,
    /// A table of subsurface profiles.
    DiffusionTableId,
}
