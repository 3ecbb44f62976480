# Run by `cargo xtask accept dist` in a bare Debian: what a user of a release does.
exec 2>&1
cd /srv
cat /etc/debian_version
! command -v rustc && ! command -v cargo
sha256sum --check SHA256SUMS
tar -xzf sonel-*-x86_64-linux.tar.gz
PATH="$(echo /srv/sonel-*-x86_64-linux/bin):$PATH"
sonel-trace --version
sonel-trace new --shoebox 9,7,3 --purpose classroom -o classroom.toml
sonel-trace check classroom.toml
sonel-trace classroom.toml -o classroom.sonelmap --packets 2000 --duration 3
sonel-render classroom.sonelmap -o classroom.npz --parameters
sonel-analyze parameters classroom.npz --format csv > classroom.csv
sonel-analyze plot classroom.npz -o classroom.png
sonel-view classroom.sonelmap classroom.npz -o classroom.html
ls -l classroom.*
pip install --break-system-packages --no-index --no-deps --force-reinstall sonel-*.whl
python3 - <<'P'
import importlib.metadata, numpy, sonel
print("numpy", numpy.__version__, "sonel", importlib.metadata.version("sonel"))
room = sonel.trace(sonel.Scene.load("classroom.toml"), packets=2000, duration=3)
room.save("python.sonelmap")
print("T30 [s]", room.render().parameters()["t30_s"][0, 0].round(2))
P
cmp classroom.sonelmap python.sonelmap
echo "the same map"
