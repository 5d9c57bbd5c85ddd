// What of a view's setting is about soft spheres, and about colours.

/** What a budget leaves as it is. */
export const softOf = (setting) => Object.fromEntries(Object.entries(setting).filter(([name]) => /^(soft(_.*)?|of|color_by|ramp|range|shade|edl_.*)$/.test(name)));

/** The strength, a number; null where nothing is soft. */
export const opacityOf = ({soft, soft_opacity: opacity = 0.3}) => (soft ? Number(opacity) : null);
