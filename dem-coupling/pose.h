/** @file pose.h
 * Orientations in space as quaternions (w, x, y, z) and as matrices, and what turns with them.
 */
#ifndef SILT_POSE_H
#define SILT_POSE_H

#include "base.h"

/** numbers of a sphere of a clump: its centre in dim numbers, its radius */
static inline int silt_clump_width(int dim) { return dim == 3 ? 4 : 3; }
/** how far a body of the plane is turned, -2 pi to 2 pi */
static inline double silt_pose_angle(const double q[4]) { return 2 * atan2(q[3], q[0]); }
/** quaternion of the rotation that carries the axes `from` to the axes `to` (three unit vectors each, in space) after q.
 * Of the two that say the same it is the one nearer to `near`. */
void silt_pose_carried(const double from[3][3], const double to[3][3], const double q[4], const double near[4], double out[4]);
/** angular velocity of a body with that tensor of inertia (xx, yy, zz, xy, xz, yz in its frame), turned by q, from its angular
 * momentum in space */
void silt_pose_spin(const double tensor[6], const double q[4], const double momentum[3], double omega[3]);
/** true when the tensor can be that of something with mass: its principal moments are above 0 and none above the sum of the others */
bool silt_pose_tensor(const double tensor[6]);

#endif
