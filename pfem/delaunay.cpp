#include "delaunay.h"

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

namespace {
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Structure = CGAL::Triangulation_data_structure_2<Vertex>;
using Delaunay = CGAL::Delaunay_triangulation_2<Kernel, Structure>;
} // namespace

int silt_delaunay_2d(int n, const double *x, int **triangle, int *n_triangle) {
    *triangle = nullptr;
    *n_triangle = 0;
    try {
        std::vector<std::pair<Kernel::Point_2, int>> cloud;
        cloud.reserve(static_cast<size_t>(n));
        for (int i = 0; i < n; i++)
            cloud.emplace_back(Kernel::Point_2(x[2 * i], x[2 * i + 1]), i);
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
