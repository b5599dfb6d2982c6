#include "vision/built_in/measurement/body.h"

#include "base/scalar.h"

// A flank's width depends on where its near corner is: rounds.
enum { CORNER_STEPS = 3 };

bslam_stance_t bslam_body_stance(const bslam_body_t *body, bslam_real_t turn)
{
    const bslam_real_t back = body->shape.depth * (body->top - body->bottom) / bslam_sqrt(1 + turn * turn);
    bslam_real_t left = body->left;
    bslam_real_t right = body->right;
    for (int32_t i = 0; i < CORNER_STEPS; i++) {
        const bslam_real_t left_flank = back * (1 + turn * left) * (turn - left);
        const bslam_real_t right_flank = back * (1 + turn * right) * (turn - right);
        left = left_flank > 0 ? body->left - left_flank : body->left;
        right = right_flank < 0 ? body->right - right_flank : body->right;
    }
    return (bslam_stance_t){(float)turn, (float)left, (float)right};
}

bslam_real_t bslam_body_middle(const bslam_body_t *body, bslam_real_t turn)
{
    const bslam_stance_t stance = bslam_body_stance(body, turn);
    const bslam_real_t half = (bslam_real_t)(stance.left - stance.right) / 2;
    const bslam_real_t centre = (bslam_real_t)(stance.left + stance.right) / 2;
    return centre - half * half * turn / (1 + centre * turn);
}

bslam_real_t bslam_body_width(const bslam_stance_t *stance)
{
    const float both = (1.0f + stance->turn * stance->left) * (1.0f + stance->turn * stance->right);
    return (bslam_real_t)(stance->left - stance->right) *
           bslam_sqrt(1 + (bslam_real_t)(stance->turn * stance->turn)) / (bslam_real_t)both;
}

bslam_stance_t bslam_outline_stance(const bslam_outline_t *o, bslam_real_t flank_least)
{
    return (bslam_stance_t){(float)o->turn,
                            o->body_left - o->left > flank_least ? (float)o->left : BSLAM_FLAT.left,
                            o->right - o->body_right > flank_least ? (float)o->right : BSLAM_FLAT.right};
}
