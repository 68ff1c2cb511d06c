// The page around Foxglove Studio's front end: one layout, kept in memory, and one data source: the
// server, or an MCAP file.
const {App, FoxgloveWebSocketDataSourceFactory, RemoteDataSourceFactory, AppSetting, initI18n} = self;
const parameters = new URLSearchParams(location.search);
const pheromones = parameters.get('pheromones').split(',');

const shown = {visible: true};
const grid = {visible: true, colorField: 'level', colorMode: 'colormap', colorMap: 'turbo', minValue: 0, maxValue: 254};
const data = {
  configById: {
    '3D!map': {
      cameraState: {perspective: false, distance: 14, phi: 0, thetaOffset: 0, targetOffset: [5, 5, 0], target: [0, 0, 0],
                    targetOrientation: [0, 0, 0, 1], fovy: 45, near: 0.5, far: 5000},
      followMode: 'follow-pose',
      followTf: 'map',
      scene: {},
      transforms: {},
      topics: Object.fromEntries([
        ...pheromones.map((name) => [`/pheromone/${name}`, grid]),
        // Not /obstacles: of two grids, which are opaque, either may be on top.
        ...['/robots', '/trails', '/tags'].map((topic) => [topic, shown]),
      ]),
      layers: {},
      publish: {type: 'point', poseTopic: '/pose', pointTopic: '/clicked_point', poseEstimateTopic: '/estimate'},
    },
    'Publish!brush': {
      topicName: '/brush',
      datatype: parameters.get('schema'),
      buttonText: 'Paint',
      buttonTooltip: '',
      buttonColor: '#00A871',
      advancedView: true,
      value: parameters.get('brush'),
    },
  },
  globalVariables: {},
  userNodes: {},
  playbackConfig: {speed: 1},
  layout: {first: '3D!map', second: 'Publish!brush', direction: 'row', splitPercentage: 70},
};

const layouts = new Map([['map', {
  id: 'map', name: 'map', permission: 'CREATOR_WRITE', baseline: {data, savedAt: undefined}, working: undefined,
  syncInfo: undefined,
}]]);
const layoutStorage = {
  list: async () => [...layouts.values()],
  get: async (namespace, id) => layouts.get(id),
  put: async (namespace, layout) => { layouts.set(layout.id, layout); return layout; },
  delete: async (namespace, id) => { layouts.delete(id); },
  importLayouts: async () => {},
};
const settings = new Map([[AppSetting.COLOR_SCHEME, 'dark'], [AppSetting.TELEMETRY_ENABLED, false],
                          [AppSetting.CRASH_REPORTING_ENABLED, false]]);
const appConfiguration = {
  get: (key) => settings.get(key),
  set: async (key, value) => { settings.set(key, value); },
  addChangeListener: () => {},
  removeChangeListener: () => {},
};

localStorage.setItem('studio.profile-data', JSON.stringify({currentLayoutId: 'map'}));
const file = parameters.get('file');
const source = file ? ['remote-file', file] : ['foxglove-websocket', parameters.get('server')];
await initI18n();
ReactDOM.render(React.createElement(App, {
  deepLinks: [`${location.origin}/?ds=${source[0]}&ds.url=${encodeURIComponent(source[1])}`],
  appConfiguration,
  dataSources: [new FoxgloveWebSocketDataSourceFactory(), new RemoteDataSourceFactory()],
  layoutStorage,
  extensionLoaders: [],
  enableGlobalCss: true,
}), document.getElementById('root'));
