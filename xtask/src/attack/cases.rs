//! What is attacked: command lines of all programs, and inputs of every kind.

/// Command lines with outputs in `out`; `{}` is `a` for the old outputs and `b` for the new ones.
pub(super) const PROGRAMS: [&str; 11] = [
    "sonel-trace {}.toml -o out/x.sonelmap --packets 20k --quiet",
    "sonel-trace {}.toml -o out/x.sonelmap --until t30<20% --packets 4k --quiet",
    "sonel-render {}.sonelmap -o out/x.npz --grid 1:4:6,1:3:6,1.2 --quiet",
    "sonel-render {}.sonelmap -o out/x.npz --grid 1.5:4:4,1.5:3:4,1.2 --bin 0.01 --wav out/sounds --ambix 1 --hrtf head.sofa --quiet",
    "sonel-analyze report {}.npz {}.sonelmap -o out/x.html --quiet",
    "sonel-analyze plot {}.npz -o out/x.svg --quiet",
    "sonel-analyze plot {}.npz -o out/x.png --quiet",
    "sonel-analyze export {}.sonelmap -o out/x.csv --quiet",
    "sonel-analyze image {}.sonelmap -o out/x.exr --eye 1,1,1.5 --look 3,2,1 --fov 90 --size 160x90 --quiet",
    "sonel-analyze merge {}1.sonelmap {}2.sonelmap -o out/x.sonelmap --quiet",
    "sonel-analyze auralise sounds-{}/1-source_1-seat.wav --recording dry.wav -o out/heard --quiet",
];

/// Kinds of input: the file, and a command that reads a damaged copy of it, `damaged` with the same ending. Whether what it prints is that of the
/// good file or nothing, as the file has a digest.
pub(super) const INPUTS: [(&str, &str, bool); 21] = [
    ("a.sonelmap", "sonel-analyze verify damaged.sonelmap", true),
    ("a.npz", "sonel-analyze parameters damaged.npz --format csv", true),
    (
        "dry.wav",
        "sonel-analyze auralise sounds-a/1-source_1-seat.wav --recording damaged.wav -o out/heard",
        false,
    ),
    (
        "head.sofa",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --wav out/sounds --hrtf damaged.sofa",
        false,
    ),
    ("a.toml", "sonel-trace check damaged.toml", false),
    ("mesh.toml", "sonel-trace check damaged.toml", false),
    ("room.obj", "sonel-trace new damaged.obj -o out/new.toml", false),
    ("text.stl", "sonel-trace new damaged.stl -o out/new.toml", false),
    ("binary.stl", "sonel-trace new damaged.stl -o out/new.toml", false),
    ("text.ply", "sonel-trace new damaged.ply -o out/new.toml", false),
    ("binary.ply", "sonel-trace new damaged.ply -o out/new.toml", false),
    ("faces.dxf", "sonel-trace new damaged.dxf -o out/new.toml", false),
    ("polyface.dxf", "sonel-trace new damaged.dxf -o out/new.toml", false),
    ("room.glb", "sonel-trace new damaged.glb -o out/new.toml", false),
    ("room.gltf", "sonel-trace new damaged.gltf -o out/new.toml", false),
    (
        "receivers.csv",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --receivers damaged.csv",
        false,
    ),
    ("library.txt", "sonel-trace materials --file damaged.txt", false),
    (
        "materials.toml",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --materials damaged.toml",
        false,
    ),
    (
        "balloon.csv",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --set sources.source.directivity=damaged.csv",
        false,
    ),
    (
        "path.csv",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --wav out/sounds --path damaged.csv --recording dry.wav",
        false,
    ),
    (
        "dry.wav",
        "sonel-render a.sonelmap -o out/x.npz --bin 0.05 --rays 16 --wav out/sounds --path path.csv --recording damaged.wav",
        false,
    ),
];

/// What may stand in the place of an input, made by the shell as `damaged`: none of it is a file to be read.
pub(super) const NO_FILES: [(&str, &str); 6] = [
    ("a pipe", "mkfifo"),
    ("a device", "ln -s /dev/zero"),
    ("a folder", "mkdir"),
    ("a link to nothing", "ln -s nowhere"),
    ("3 GiB of nothing", "truncate -s 3G"),
    ("UTF-16", "printf '\\377\\376m\\0e\\0' >"),
];

/// What may become of stdout and stderr, and who reads them.
pub(super) const STREAMS: [(&str, &str); 8] = [
    (">&-", ""),
    ("2>&-", ""),
    (">&- 2>&-", ""),
    ("> /dev/full", ""),
    ("2> /dev/full", ""),
    ("> /dev/full 2>&1", ""),
    ("2>&1", "| true"),
    ("2> /dev/full", "| true"),
];

/// A room of the walls `absorption`.
pub(super) fn scene(absorption: &str) -> String {
    format!(
        "shoebox = [5.0, 4.0, 3.0]\nduration_s = 0.4\n[bands]\ncenter_frequencies_hz = [500, 1000]\n[materials.walls]\nabsorption = {absorption}\n\
         scattering = 0.5\n[[sources]]\nname = \"source\"\nposition = [1.0, 1.0, 1.5]\n[[receivers]]\nname = \"seat\"\nposition = [3.0, 2.0, 1.5]\n"
    )
}

/// A room with a mesh.
pub(super) const MESH_SCENE: &str = "mesh = \"room.obj\"\nduration_s = 0.2\n[materials.walls]\nabsorption = 0.1\n[materials.floor]\nabsorption = 0.1\n\
                                     [[sources]]\nposition = [1.0, 1.0, 1.0]\n";
/// Another material, and a talker.
pub(super) const MATERIALS: &str = "[materials.walls]\nabsorption = 0.4\nscattering = 0.5\n";
pub(super) const BALLOON: &str = "azimuth_deg,polar_deg,500,1000\n0,0,0,0\n0,90,-3,-6\n0,180,-6,-12\n";
/// A walk of a tenth of a second.
pub(super) const PATH: &str = "time,x,y,z\n0,3,2,1.5\n0.1,3.1,2,1.5\n";
/// Places.
pub(super) const RECEIVERS: &str = "name,x,y,z\na,3,2,1.2\n\"b, left\",2,3,1.2\n";
