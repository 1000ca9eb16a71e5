/** @file scene_motion.c
 * What the keys of a body's motion must be together: paths, held components, springs, releases.
 */
#include "scene_keys.h"

// one of the keys that only a free body has
static void motion_only_free(silt_reader *reader, const silt_tree *node, const silt_body_def *body, const char *key, int i) {
    const silt_tree *item = silt_tree_item(node, key);
    if (item && body->motion != MOTION_FREE)
        silt_complain_key(reader, item, "key 'bodies.%d.%s': found it beside motion: %s, allowed only where motion is free", i, key,
                          body->motion == MOTION_FIXED ? "fixed" : "prescribed");
}

static void motion_path(silt_reader *reader, const silt_tree *node, const silt_body_def *body, int i) {
    const silt_tree *item = silt_tree_item(node, "path");
    if (item && body->motion != MOTION_PRESCRIBED)
        silt_complain_key(reader, item, "key 'bodies.%d.path': found it beside motion: %s, allowed only with motion: prescribed", i,
                          body->motion == MOTION_FIXED ? "fixed" : "free");
    if (body->motion == MOTION_PRESCRIBED && !item)
        silt_complain_key(reader, node, "key 'bodies.%d.path': found nothing in this block, allowed a CSV file beside the scene, since its motion "
                                        "is prescribed", i);
}

// a speed at the start that is none
static void motion_speed(silt_reader *reader, const silt_tree *node, const silt_body_def *body, int i) {
    static const char name[3] = {'x', 'y', 'z'};
    const silt_tree *item = silt_tree_item(node, "velocity");
    for (int d = 0; d < 3 && item; d++) {
        const char *why = body->motion == MOTION_PRESCRIBED ? "its path says how fast it is"
                          : body->release.on                ? "it is held until its release"
                          : body->held >> d & 1             ? "it is held there"
                                                            : NULL;
        if (body->velocity[d] != 0 && why) {
            silt_complain(reader, item, "key 'bodies.%d.velocity': found %g m/s along %c, allowed 0: %s", i, body->velocity[d], name[d], why);
            return;
        }
    }
}

static void motion_springs(silt_reader *reader, const silt_tree *node, const silt_body_def *body, int i) {
    const silt_tree *list = silt_tree_item(node, "springs");
    for (int k = 0; k < body->n_spring; k++) {
        const silt_spring_def *s = &body->spring[k];
        if (s->length > 0 && s->at[0] == s->to[0] && s->at[1] == s->to[1] && s->at[2] == s->to[2])
            silt_complain(reader, silt_tree_item(list->item[k], "to"),
                          "key 'bodies.%d.springs.%d.to': found the point 'at' again under a length of %g m, allowed another point: the spring has "
                          "no direction", i, k, s->length);
    }
}

void silt_scene_check_motion(silt_reader *reader, const silt_scene *scene) {
    static const char *const free_only[3] = {"held", "springs", "release"};
    for (int i = 0; i < scene->n_body; i++) {
        const silt_body_def *body = &scene->body[i];
        const silt_tree *node = silt_tree_find(reader->root, "bodies.%d", i);
        for (int k = 0; k < 3; k++)
            motion_only_free(reader, node, body, free_only[k], i);
        motion_path(reader, node, body, i);
        motion_speed(reader, node, body, i);
        motion_springs(reader, node, body, i);
        if (body->release.on && isnan(body->release.time) && isnan(body->release.force))
            silt_complain(reader, silt_tree_item(node, "release"),
                          "key 'bodies.%d.release': found neither a time nor a force, allowed at least one of time, force", i);
    }
}
