// What of a view's setting says what is shown, not how it is drawn: soft spheres, colours, what is cut away.

/** What a budget leaves as it is. */
export const keptOf = (setting) =>
  Object.fromEntries(
    Object.entries(setting).filter(([name]) =>
      /^(soft(_.*)?|of|color_by|ramp|range|shade|edl_.*|clip|class|near|far|background)$/.test(name),
    ),
  );

/** The strength, a number; null where nothing is soft. */
export const opacityOf = ({soft, soft_opacity: opacity = 0.3}) => (soft ? Number(opacity) : null);
