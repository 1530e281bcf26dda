//! Options with a fixed set of values.

use clap::ValueEnum;

macro_rules! choices {
    ($($name:ident { $($variant:ident),* })*) => { $(
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
        pub enum $name { $($variant),* }
    )* };
}

choices! {
    FormatArg { Gltf, Glb, Obj }
    UpArg { Y, Z }
    FilterArg { Box, Tent, Gaussian, BlackmanHarris }
    ViewArg { Auto, Standard, Agx, PbrNeutral, Raw }
    ProjectionArg { Perspective, Orthographic }
    FitArg { Auto, Horizontal, Vertical }
    UnitsArg { Auto, Standard, Unitless, Raw }
    IntegratorArg { Phong, Shadow, Diffuse, Color }
    GlassArg { Auto, Thin, Solid }
    GroundArg { Shadow, Plane }
    CullArg { Auto, Back, Off }
    TurnArg { Model, Camera }
    DirectionArg { Ccw, Cw }
    EaseArg { None, InOut }
    LoopArg { Forever, Once }
    UnitShapeArg { UnitCube, UnitSphere }
    ProgressArg { Auto, Plain, Json, Openjd, None }
}
