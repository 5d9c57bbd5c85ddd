// What of a view's setting is about soft spheres.

/** What a budget leaves as it is. */
export const softOf = (setting) => Object.fromEntries(Object.entries(setting).filter(([name]) => /^(soft(_.*)?|of)$/.test(name)));

/** The strength, a number; null where nothing is soft. */
export const opacityOf = ({soft, soft_opacity: opacity = 0.3}) => (soft ? Number(opacity) : null);
