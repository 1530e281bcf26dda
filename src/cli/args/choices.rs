//! Options with a fixed set of values.

use clap::ValueEnum;

macro_rules! choices {
    ($($name:ident { $($variant:ident),* })*) => { $(
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
        pub enum $name { $($variant),* }
    )* };
}

choices! {
    UpArg { Y, Z }
    TurnArg { Model, Camera }
    DirectionArg { Ccw, Cw }
    EaseArg { None, InOut }
    LoopArg { Forever, Once }
    UnitShapeArg { UnitCube, UnitSphere }
    ProgressArg { Auto, Plain, Json, Openjd, None }
    ColorArg { Auto, Always, Never }
    PathsArg { Lines, Null }
}
