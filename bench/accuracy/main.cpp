// marrow-accuracy: what the surfaces of phantoms of known size are worth.
#include <cmath>

#include <fmt/format.h>

#include "plates.h"

using namespace marrow::bench;

#include <chrono>
#include <marrow/marrow.h>
void real(const char* path) {
    using namespace marrow;
    Volume v = read_scan(path);
    auto t0 = std::chrono::steady_clock::now();
    auto lap=[&](const char* n){ auto t=std::chrono::steady_clock::now(); fmt::print("{} {:.3f} s\n", n, std::chrono::duration<double>(t-t0).count()); t0=std::chrono::steady_clock::now(); };
    for (int r=0;r<4;++r){
    Mesh m = extract_isosurface(v, 225.5, {.closed=true}); lap("extract");
    auto n = estimate_noise(v); lap("noise");
    fmt::print("sigma {} mode {} slices {} lap {} windows {}\n", n.sigma, n.local_deviation, n.slices.value_or(0), n.laplacian, n.windows);
    ThinWalls w = find_thin_walls(v, 225.5, m, {.noise=n.sigma}); lap("find");
    fmt::print("area {} walls {} samples {} points {}\n", w.area, w.walls.size(), w.samples.size(), m.points.size());
    for (std::size_t i=0;i<std::min<std::size_t>(8,w.walls.size());++i) fmt::print("  {:.1f} mm2 at {:.1f} {:.1f} {:.1f}\n", w.walls[i].area, w.walls[i].position[0], w.walls[i].position[1], w.walls[i].position[2]);
    if (r==3) { Volume k = restore_thin_walls(v, 225.5, w); lap("restore");
    Mesh m2 = extract_isosurface(k, 225.5, {.closed=true,.topology=true}); lap("again");
    auto a=measure(m), b=measure(m2); fmt::print("area {} -> {}, volume {} -> {}, comps {} -> {} handles chi {} -> {} sound {}\n", a.area,b.area,a.volume,b.volume,a.components,b.components,a.euler_characteristic,b.euler_characteristic, check_mesh(m2).is_sound());
      auto tr=report_trust(v, m.points, {.step=100, .noise=n}); lap("trust"); fmt::print("shift {} {} {} capped {} noise {} {} {}\n", tr.shifts.median,tr.shifts.percentile_90,tr.shifts.percentile_99,tr.shifts.capped,tr.noise_shifts.median,tr.noise_shifts.percentile_90,tr.noise_shifts.percentile_99);
      write_mesh(m, "/tmp/trust_before.ply"); (void)0; write_mesh(m2, "/tmp/trust_after.ply"); }
    }
}
int main(int argc, char** argv) {
    if (argc > 1) { real(argv[1]); return 0; }
    const double fwhm = 1.0, sigma = fwhm / 2.3548;
    for (const double noise : {10.0, 40.0}) {
        for (const double background : {-1000.0, 40.0}) {
            for (const double w : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0}) {
                const Scanner scanner{
                    .spacing = 0.5, .slice = 0.8, .background = background, .material = 1500, .noise = noise};
                const PlateResult r = examine_plate(w, sigma, 225.5, scanner);
                fmt::print(
                    "{:5} {:6} {:4} shown {:.3f} thick {:.2f} alarm {:6.1f} restored {:.3f} thick {:.2f} "
                    "added {:.1f} sound {}\n",
                    noise, background, w, r.shown, r.thickness, r.alarm, r.restored, r.restored_thickness,
                    r.restored_volume, r.sound);
            }
        }
    }
}
