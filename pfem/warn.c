// what is allowed but will probably not do what was meant
#include "output.h"

int silt_scene_warn(const silt_scene *scene, FILE *to) {
    int count = 0;
    // a body drags its added mass along; for a disc that is the displaced water, for a box of equal sides 1.19 of it
    for (int b = 0; b < scene->n_body && scene->fluid.on; b++) {
        const silt_body_def *body = &scene->body[b];
        if (body->motion == MOTION_FREE && body->density < 1.2 * scene->fluid.density) {
            fprintf(to, "%s: warning: body '%s' has density %g kg/m3, the water %g: below about its added mass the body's motion is "
                        "unstable with the weak coupling of this version\n",
                    scene->path, body->name, body->density, scene->fluid.density);
            count++;
        }
    }
    // parcels about as large as the patches that release them find room again; much smaller ones mostly fill pores
    const double parcel = scene->grains.parcel;
    if (scene->bed.on && scene->grains.on && isfinite(scene->bed.work) && parcel > 0 &&
        (parcel < 0.3 * scene->bed.size || parcel > 1.2 * scene->bed.size)) {
        fprintf(to, "%s: warning: grains.parcel is %g of bed.size; 0.5 to 0.8 lets released parcels find room and come to rest as bed\n",
                scene->path, parcel / scene->bed.size);
        count++;
    }
    return count;
}
