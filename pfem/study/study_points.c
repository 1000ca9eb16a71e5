// from ranges to points: the values of every range as texts, and what a point sets
#include "study.h"

static double points_number(const study_range *r, int k, uint64_t *random) {
    const double share = r->kind == RANGE_RANDOM || r->kind == RANGE_LOG_RANDOM ? silt_uniform(random)
                         : r->count > 1                                         ? (double)k / (r->count - 1)
                                                                                : 0;
    const bool log_scale = r->kind == RANGE_LOG || r->kind == RANGE_LOG_RANDOM;
    if (share == 0 || share == 1)
        return share == 0 ? r->low : r->high;
    return log_scale ? r->low * pow(r->high / r->low, share) : r->low + share * (r->high - r->low);
}

void study_points(study *s) {
    for (int i = 0; i < s->n_range; i++) {
        study_range *r = &s->range[i];
        // a range's numbers hang on its place and the seed alone
        uint64_t random = silt_hash(0, &(const int[2]){s->seed, i}, 2 * sizeof(int));
        r->n_text = r->kind == RANGE_VALUES ? r->n_value : r->count;
        r->text = silt_alloc((size_t)r->n_text, sizeof *r->text);
        for (int k = 0; k < r->n_text; k++)
            r->text[k] = r->kind == RANGE_VALUES ? silt_text("%s", r->value[k])
                                                 : silt_text("%.6g", points_number(r, k, &random));
    }
}

int study_count(const study *s) {
    int n = 1;
    for (int i = 0; i < s->n_range; i++)
        n = s->combine == COMBINE_TOGETHER ? s->range[i].n_text : n * s->range[i].n_text;
    return n;
}

const char *study_value(const study *s, int k, int r) {
    if (s->combine == COMBINE_TOGETHER)
        return s->range[r].text[k];
    // the last range runs fastest
    for (int i = s->n_range - 1; i > r; i--)
        k /= s->range[i].n_text;
    return s->range[r].text[k % s->range[r].n_text];
}

static char *points_set(const char *key, const char *form, const char *value) {
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    if (!to)
        return silt_text("%s=%s", key, value);
    fprintf(to, "%s=", key);
    for (const char *c = form; *c; c++)
        if (*c == '%')
            fputs(value, to);
        else
            fputc(*c, to);
    fclose(to);
    return text;
}

void study_assign(char ***set, int *n_set, int *capacity, const char *key, const char *form, int n_with,
                  const study_with *with, const char *value) {
    SILT_RESERVE(*set, *capacity, *n_set + 1 + n_with);
    (*set)[(*n_set)++] = points_set(key, form, value);
    for (int i = 0; i < n_with; i++) {
        double x;
        char *scaled = with[i].factor != 1 && silt_text_number(value, &x) ? silt_text("%.12g", with[i].factor * x)
                                                                          : silt_text("%s", value);
        (*set)[(*n_set)++] = points_set(with[i].key, with[i].form, scaled);
        free(scaled);
    }
}
