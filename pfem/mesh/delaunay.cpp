#include "delaunay.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <cstdlib>
#include <ctime>
#include <new>
#include <utility>
#include <vector>

namespace {
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<Vertex>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;
using Vertex3 = CGAL::Triangulation_vertex_base_with_info_3<int, Kernel>;
using Cell3 = CGAL::Delaunay_triangulation_cell_base_3<Kernel>;
using Structure3 = CGAL::Triangulation_data_structure_3<Vertex3, Cell3>;
using Delaunay3 = CGAL::Delaunay_triangulation_3<Kernel, Structure3>;

template <class Mesh, class Cloud> double seconds_of(const Cloud &cloud) {
    const std::clock_t since = std::clock();
    Mesh mesh(cloud.begin(), cloud.end());
    return static_cast<double>(std::clock() - since) / CLOCKS_PER_SEC;
}

std::vector<std::pair<Kernel::Point_2, int>> cloud_2d(int n, const double *x) {
    std::vector<std::pair<Kernel::Point_2, int>> cloud;
    cloud.reserve(static_cast<size_t>(n));
    for (int i = 0; i < n; i++)
        cloud.emplace_back(Kernel::Point_2(x[2 * i], x[2 * i + 1]), i);
    return cloud;
}

std::vector<std::pair<Kernel::Point_3, int>> cloud_3d(int n, const double *x) {
    std::vector<std::pair<Kernel::Point_3, int>> cloud;
    cloud.reserve(static_cast<size_t>(n));
    for (int i = 0; i < n; i++)
        cloud.emplace_back(Kernel::Point_3(x[3 * i], x[3 * i + 1], x[3 * i + 2]), i);
    return cloud;
}
} // namespace

double silt_delaunay_seconds(int dim, int n, const double *x) {
    try {
        return dim == 3 ? seconds_of<Delaunay3>(cloud_3d(n, x)) : seconds_of<Delaunay>(cloud_2d(n, x));
    } catch (const std::bad_alloc &) {
        return -1;
    }
}

int silt_delaunay_2d(int n, const double *x, int **triangle, int *n_triangle) {
    *triangle = nullptr;
    *n_triangle = 0;
    try {
        const auto cloud = cloud_2d(n, x);
        Delaunay mesh(cloud.begin(), cloud.end());
        const size_t count = mesh.dimension() == 2 ? mesh.number_of_faces() : 0;
        int *out = static_cast<int *>(std::malloc((count ? count : 1) * 3 * sizeof(int)));
        if (!out)
            return -1;
        size_t k = 0;
        for (auto face = mesh.finite_faces_begin(); count && face != mesh.finite_faces_end(); ++face)
            for (int a = 0; a < 3; a++)
                out[k++] = face->vertex(a)->info();
        *triangle = out;
        *n_triangle = static_cast<int>(count);
        return 0;
    } catch (const std::bad_alloc &) {
        return -1;
    }
}

int silt_delaunay_3d(int n, const double *x, int **tetrahedron, int *n_tetrahedron) {
    *tetrahedron = nullptr;
    *n_tetrahedron = 0;
    try {
        const auto cloud = cloud_3d(n, x);
        // points are put in along a space-filling curve; ties are broken by the order of the coordinates, not of
        // insertion
        Delaunay3 mesh(cloud.begin(), cloud.end());
        const size_t count = mesh.dimension() == 3 ? mesh.number_of_finite_cells() : 0;
        int *out = static_cast<int *>(std::malloc((count ? count : 1) * 4 * sizeof(int)));
        if (!out)
            return -1;
        size_t k = 0;
        for (auto cell = mesh.finite_cells_begin(); count && cell != mesh.finite_cells_end(); ++cell)
            for (int a = 0; a < 4; a++)
                out[k++] = cell->vertex(a)->info();
        *tetrahedron = out;
        *n_tetrahedron = static_cast<int>(count);
        return 0;
    } catch (const std::bad_alloc &) {
        return -1;
    }
}
