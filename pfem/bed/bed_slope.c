// slopes steeper than the angle of repose give way
#include "bed_law.h"
#include "bed_mesh.h"

#define SLOPE_RINGS 8    // nodes along the surface, how far a node looks down
#define SLOPE_STEP 0.75  // bed.size: a step that a single release cuts is no slope

// neighbours of every node along the surface
typedef struct slope_graph {
    int *start, *item; // owned
} slope_graph;

enum { CORNERS = sizeof((silt_bed *)0)->edge[0] / sizeof(int) };

static void graph_make(slope_graph *graph, const silt_bed *bed) {
    graph->start = silt_alloc((size_t)bed->n_node + 2, sizeof *graph->start);
    graph->item = silt_alloc((size_t)bed->n_edge * CORNERS * (CORNERS - 1) + 1, sizeof *graph->item);
    for (int pass = 0; pass < 2; pass++) {
        for (int e = 0; e < bed->n_edge; e++)
            for (int a = 0; a < CORNERS; a++)
                for (int b = 0; b < CORNERS; b++) {
                    const int i = bed->edge[e][a], j = bed->edge[e][b];
                    if (i < 0 || j < 0 || a == b)
                        continue;
                    if (pass == 0)
                        graph->start[i + 2]++;
                    else
                        graph->item[graph->start[i + 1]++] = j;
                }
        for (int k = 0; k < bed->n_node && pass == 0; k++)
            graph->start[k + 2] += graph->start[k + 1];
    }
}

// m, how much higher a node stands than a slope of this gradient allows above any node near it
static double slope_excess(const silt_bed *bed, const slope_graph *graph, const double *height, double gradient, double step, int node,
                           int *seen, int *queue) {
    int head = 0, tail = 1, ring_end = 1;
    double excess = -HUGE_VAL;
    queue[0] = node;
    seen[node] = node + 1;
    for (int ring = 0; ring < SLOPE_RINGS && head < tail; ring++, ring_end = tail)
        for (; head < ring_end; head++)
            for (int q = graph->start[queue[head]]; q < graph->start[queue[head] + 1]; q++) {
                const int j = graph->item[q];
                if (seen[j] == node + 1)
                    continue;
                seen[j] = node + 1;
                queue[tail++] = j;
                double way = 0;
                for (int d = 0; d < 3; d++)
                    way += silt_square(bed->x[node][d] - bed->x[j][d]);
                const double drop = height[node] - height[j];
                excess = silt_max(excess, drop - gradient * sqrt(silt_max(way - drop * drop, 0)) - step);
            }
    return excess;
}

int silt_bed_steep(const silt_bed *bed, const silt_scene *scene, int capacity, int *node) {
    const double g = silt_length(3, scene->gravity);
    if (scene->bed.repose <= 0 || !(g > 0) || bed->n_edge == 0)
        return 0;
    const double gradient = tan(scene->bed.repose * M_PI / 180), step = SLOPE_STEP * bed_size(scene);
    slope_graph graph;
    graph_make(&graph, bed);
    const size_t size = (size_t)bed->n_node + 1;
    double *height = silt_alloc(size, sizeof *height), *excess = silt_alloc(size, sizeof *excess);
    int *seen = silt_alloc(size, sizeof *seen), *queue = silt_alloc(size, sizeof *queue);
    for (int k = 0; k < bed->n_node; k++)
        height[k] = -silt_dot(3, bed->x[k], scene->gravity) / g;
    for (int k = 0; k < bed->n_node; k++)
        excess[k] = bed->exposed[k] ? slope_excess(bed, &graph, height, gradient, step, k, seen, queue) : 0;
    // the worst of its neighbours falls
    int n = 0;
    for (int k = 0; k < bed->n_node && n < capacity; k++) {
        bool worst = excess[k] > 0;
        for (int q = graph.start[k]; q < graph.start[k + 1] && worst; q++)
            worst = excess[graph.item[q]] <= excess[k];
        if (worst)
            node[n++] = k;
    }
    free(graph.start);
    free(graph.item);
    free(height);
    free(excess);
    free(seen);
    free(queue);
    return n;
}
