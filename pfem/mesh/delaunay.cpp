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

int triangles_of(const Delaunay &mesh, int **triangle, int *n_triangle) {
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
        return triangles_of(Delaunay(cloud.begin(), cloud.end()), triangle, n_triangle);
    } catch (const std::bad_alloc &) {
        return -1;
    }
}

// ---- a triangulation that is kept: nodes move, edges flip until it is Delaunay's again

// From scratch a triangulation takes 500 ns a node, this 110: three tests of edges a node and a few flips. Where a node went through more
// than one edge, or two stand at one place, it is made from scratch: at 6 of the 452 steps of collapse-2d at N = 20.
struct silt_delaunay {
    Delaunay mesh;
    int known = 0;         // nodes of the numbering that the vertices are in
    bool followed = false; // the last time, not made from scratch
};

namespace {
using Face = Delaunay::Face_handle;

// the face across, and the vertex that it has alone
Delaunay::Vertex_handle across(const Face &face, int i, Face &other) {
    other = face->neighbor(i);
    return other->vertex(other->index(face));
}

// A triangle that was turned inside out has a node that went through one of its edges: that edge flips. @return false: not that simple
bool unfold(Delaunay &mesh, std::vector<Face> &turned) {
    for (int round = 0; round < 8 && !turned.empty(); round++) {
        size_t left = 0;
        for (const Face face : turned) {
            if (mesh.is_infinite(face) ||
                mesh.orientation(face->vertex(0)->point(), face->vertex(1)->point(), face->vertex(2)->point()) == CGAL::POSITIVE)
                continue;
            bool flipped = false;
            for (int i = 0; i < 3 && !flipped; i++) {
                Face other;
                const auto d = across(face, i, other);
                const auto &a = face->vertex(i)->point(), &b = face->vertex(Delaunay::ccw(i))->point(),
                           &c = face->vertex(Delaunay::cw(i))->point();
                if (mesh.is_infinite(d))
                    flipped = CGAL::squared_distance(b, c) > CGAL::max(CGAL::squared_distance(a, b), CGAL::squared_distance(a, c));
                else
                    flipped = mesh.orientation(a, b, d->point()) == CGAL::POSITIVE &&
                              mesh.orientation(a, d->point(), c) == CGAL::POSITIVE;
                if (flipped)
                    mesh.tds().flip(face, i);
            }
            if (!flipped)
                turned[left++] = face;
        }
        turned.resize(left);
    }
    return turned.empty();
}

// whether an edge between two triangles, or between two edges of the hull, has to flip; ties are broken as in an insertion
bool edge_wrong(const Delaunay &mesh, const Face &face, int i) {
    Face other;
    const auto d = across(face, i, other);
    const bool outside = mesh.is_infinite(face), beyond = mesh.is_infinite(other);
    return outside == beyond && mesh.side_of_oriented_circle(face, d->point(), true) == CGAL::ON_POSITIVE_SIDE;
}

// the hull goes round once
bool hull_simple(const Delaunay &mesh) {
    int tops = 0;
    auto edge = mesh.incident_vertices(mesh.infinite_vertex()), first = edge;
    do {
        const auto before = edge, at = ++edge;
        auto after = at;
        ++after;
        tops += mesh.compare_xy(at->point(), before->point()) == CGAL::LARGER &&
                mesh.compare_xy(at->point(), after->point()) == CGAL::LARGER;
    } while (edge != first);
    return tops == 1;
}

// flips until no edge is wrong. @return false: it did not end well
bool repair(Delaunay &mesh) {
    std::vector<Face> stack;
    for (auto face = mesh.finite_faces_begin(); face != mesh.finite_faces_end(); ++face)
        if (mesh.orientation(face->vertex(0)->point(), face->vertex(1)->point(), face->vertex(2)->point()) != CGAL::POSITIVE)
            stack.push_back(face);
    if (!unfold(mesh, stack))
        return false;
    size_t flips = 0, most = 20 * mesh.number_of_vertices() + 100;
    for (auto at = mesh.all_faces_begin(); at != mesh.all_faces_end(); ++at) {
        stack.push_back(at);
        // every edge is looked at from one side, and anew where its triangles changed
        for (bool sweep = true; !stack.empty(); sweep = false) {
            const Face face = stack.back();
            stack.pop_back();
            for (int i = 0; i < 3; i++) {
                const Face other = face->neighbor(i);
                if ((sweep && &*other < &*face) || !edge_wrong(mesh, face, i))
                    continue;
                if (flips++ > most)
                    return false;
                mesh.tds().flip(face, i);
                stack.push_back(other);
                stack.push_back(face);
                break;
            }
        }
    }
    return hull_simple(mesh);
}

// the kept triangulation at the new places, without the dead and with what came. @return false: to be made from scratch
bool follow(silt_delaunay &kept, int n, const double *x, const uint8_t *dead, int n_live) {
    Delaunay &mesh = kept.mesh;
    if (mesh.dimension() != 2 || kept.known > n)
        return false;
    std::vector<Delaunay::Vertex_handle> gone;
    for (auto vertex = mesh.finite_vertices_begin(); vertex != mesh.finite_vertices_end(); ++vertex)
        if (dead && dead[vertex->info()])
            gone.push_back(vertex);
    for (const auto &vertex : gone)
        mesh.remove(vertex);
    if (mesh.dimension() != 2)
        return false;
    for (auto vertex = mesh.finite_vertices_begin(); vertex != mesh.finite_vertices_end(); ++vertex)
        vertex->set_point(Kernel::Point_2(x[2 * vertex->info()], x[2 * vertex->info() + 1]));
    if (!repair(mesh))
        return false;
    Face near = mesh.finite_faces_begin();
    for (int i = kept.known; i < n; i++)
        if (!dead || !dead[i]) {
            const auto vertex = mesh.insert(Kernel::Point_2(x[2 * i], x[2 * i + 1]), near);
            vertex->info() = i;
            near = vertex->face();
        }
    return mesh.number_of_vertices() == static_cast<size_t>(n_live);
}
} // namespace

int silt_delaunay_follow(silt_delaunay **kept, int n, const double *x, const uint8_t *dead, int **triangle, int *n_triangle) {
    *triangle = nullptr;
    *n_triangle = 0;
    try {
        if (!*kept)
            *kept = new silt_delaunay;
        int n_live = 0;
        for (int i = 0; i < n; i++)
            n_live += !dead || !dead[i];
        Delaunay &mesh = (*kept)->mesh;
        (*kept)->followed = follow(**kept, n, x, dead, n_live);
        if (!(*kept)->followed) {
            std::vector<std::pair<Kernel::Point_2, int>> cloud;
            cloud.reserve(static_cast<size_t>(n_live));
            for (int i = 0; i < n; i++)
                if (!dead || !dead[i])
                    cloud.emplace_back(Kernel::Point_2(x[2 * i], x[2 * i + 1]), i);
            mesh.clear();
            mesh.insert(cloud.begin(), cloud.end());
        }
        (*kept)->known = n;
        return triangles_of(mesh, triangle, n_triangle);
    } catch (const std::bad_alloc &) {
        silt_delaunay_free(kept);
        return -1;
    }
}

void silt_delaunay_renumber(silt_delaunay *kept, const int *map, int n_new) {
    if (!kept)
        return;
    for (auto vertex = kept->mesh.finite_vertices_begin(); vertex != kept->mesh.finite_vertices_end(); ++vertex)
        vertex->info() = map[vertex->info()];
    kept->known = n_new;
}

int silt_delaunay_followed(const silt_delaunay *kept) {
    return kept && kept->followed;
}

void silt_delaunay_free(silt_delaunay **kept) {
    delete *kept;
    *kept = nullptr;
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
