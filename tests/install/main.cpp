#include <marrow/marrow.h>
int main() {
    const marrow::Volume scan = marrow::read_scan("head-ct/");
    const marrow::Mesh skull = marrow::extract_isosurface(scan, 226.0f);
    marrow::write_mesh(skull, "skull.stl");
}
